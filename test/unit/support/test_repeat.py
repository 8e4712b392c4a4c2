"""Which failing tests run again: those during which the machine stood still, at most two of a run."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.suite.repeat import LEASE, MOST
from support.suite.stalls import FILE, StallRecorder, stalls_since

TESTS = Path(__file__).parents[2]

CONFTEST = """
from support.suite.repeat import Repeat

def pytest_configure(config):
    config.pluginmanager.register(Repeat(), "repeat")

def pytest_collection_modifyitems(config, items):
    for item in items:
        config.pluginmanager.get_plugin("repeat").excuse(item)
"""

FLAKY = """
import os, time
from pathlib import Path
import pytest

@pytest.mark.parametrize("name", range(3))
def test_that_fails_once(name, request):
    marker = Path(__file__).with_name(f"ran-{name}")
    if not marker.exists():
        marker.touch()
        duration = os.environ["STALL"]
        with open(os.environ["SOLFER_TEST_STALLS"], "a") as stalls:
            stalls.write(f"{time.monotonic()} {duration} 0 0.0\\n")
        raise AssertionError
"""


@pytest.mark.slow
@pytest.mark.parametrize(("stall", "failed"), [(1.1 * LEASE, 3 - MOST), (0.9 * LEASE, 3)])
def test_only_a_stall_excuses_a_failure(tmp_path, stall, failed):
    """Three tests fail once each during stalls: two of them are repeated, none if the stalls are short."""
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_flaky.py").write_text(FLAKY)
    stalls = tmp_path / "stalls"
    stalls.touch()
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--max-suite-reruns", str(MOST)]
    environment = os.environ | {FILE: str(stalls), "STALL": str(stall), "PYTHONPATH": str(TESTS)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert f"{failed} failed" in done.stdout, done.stdout + done.stderr
    assert (f"{MOST} rerun" in done.stdout) == (failed < 3)


@pytest.mark.slow
def test_a_stall_is_recorded(tmp_path, monkeypatch):
    """A watcher that is stopped for longer than a lease takes that for a stall of the machine."""
    monkeypatch.setenv(FILE, "")
    watcher = StallRecorder(tmp_path)
    time.sleep(0.3)
    begin = time.monotonic()
    watcher._process.send_signal(signal.SIGSTOP)
    time.sleep(1.5 * LEASE)
    watcher._process.send_signal(signal.SIGCONT)
    end = begin + 30.0
    while not (found := stalls_since(begin, LEASE)):
        assert time.monotonic() < end
        time.sleep(0.01)
    watcher.close()
    assert found[0].duration >= LEASE
    assert "stood still" in str(found[0])
    assert stalls_since(time.monotonic(), LEASE) == []
