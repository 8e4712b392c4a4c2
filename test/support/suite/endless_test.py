"""Tests that `test_supervision.py` interrupts: one that fails, and one that starts processes and does not end."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path


def test_that_fails():
    raise AssertionError("on purpose")


def test_that_children_receive_interrupts():
    code = "import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "True\n"


def test_without_end():
    subprocess.Popen(["bash", "-c", "setsid sleep 1000 & sleep 1000"], start_new_session=True)
    subprocess.Popen(["bash", "-c", "setsid sleep 1000 & disown"]).wait()
    Path(os.environ["ENDLESS_TEST"], "started").touch()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    time.sleep(1000.0)
