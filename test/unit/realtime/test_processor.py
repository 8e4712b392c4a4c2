"""How long a loop was kept from running, in a process of its own."""

import signal
import subprocess
import sys
import time

import pytest

PROGRAM = """
import os, sys, time
from solfer.realtime.processor import Interruptions
def spin():
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        pass
def stops():
    print("stops", flush=True)
    sys.stdin.readline()
def shares():
    processor = min(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {processor})
    if not os.fork():
        os.sched_setaffinity(0, {processor})
        spin()
        os._exit(0)
    spin()
interruptions = Interruptions()
for what in (lambda: time.sleep(0.5), stops, lambda: None, shares):
    interruptions.start()
    what()
    print(interruptions.in_cycle(), flush=True)
"""


@pytest.fixture
def process():
    """Run the program."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as made:
        yield made
        made.kill()


def test_stops_and_other_processes_interrupt_and_calls_that_block_do_not(process):
    blocked = int(process.stdout.readline())
    assert process.stdout.readline() == "stops\n"
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.05)
    process.send_signal(signal.SIGCONT)
    print(file=process.stdin, flush=True)
    stopped, nothing, shared = (int(process.stdout.readline()) for _ in range(3))
    assert stopped == sys.maxsize
    assert nothing < sys.maxsize
    assert 1e8 < shared < 1e9
    assert blocked < 0.5 * shared
