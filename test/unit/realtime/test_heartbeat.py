"""The heartbeat of a process in shared memory, read by another process."""

import multiprocessing
import os
import signal
import time

import pytest
from support.processes import until

from solfer.errors import MiddlewareError
from solfer.realtime import heartbeat
from solfer.realtime.heartbeat import Heartbeat
from solfer.telemetry.statistics import RuntimeStatistics

WAIT = 30.0  # [s]


@pytest.fixture(autouse=True)
def _look_at_once(monkeypatch):
    monkeypatch.setattr(heartbeat.Heartbeat, "POLL_PERIOD", 0.0)


def statistics(folder, rate=500.0):
    """Create an executor's statistics."""
    return RuntimeStatistics.create(folder, rate, ["plugin"], ["component"])


def beat(folder, ready):
    """Beat until the process is killed."""
    heart = statistics(folder)
    while True:
        heart.beat(time.monotonic_ns())
        ready.set()
        time.sleep(0.002)


@pytest.fixture
def process(tmp_path):
    """Start a process that beats."""
    context = multiprocessing.get_context("fork")
    ready = context.Event()
    made = context.Process(target=beat, args=(tmp_path, ready), daemon=True)
    made.start()
    assert ready.wait(WAIT)
    yield made
    made.kill()
    made.join(WAIT)


def test_without_a_process_there_is_no_heartbeat(tmp_path):
    heartbeat = Heartbeat(tmp_path)
    assert heartbeat.beats() is None
    assert heartbeat.age() == float("inf")
    assert not heartbeat.alive()


def test_beats_change_and_give_the_period(tmp_path):
    heart, heartbeat = statistics(tmp_path), Heartbeat(tmp_path)
    assert heartbeat.beats() is None
    heart.beat(time.monotonic_ns())
    first = heartbeat.beats()
    heart.beat(time.monotonic_ns())
    assert heartbeat.beats() > first
    assert (heartbeat.pid, heartbeat.generation, heartbeat.period) == (os.getpid(), 1, 0.002)
    assert heartbeat.alive()


def test_an_orderly_end_ends_the_heartbeat(tmp_path):
    heart, heartbeat = statistics(tmp_path), Heartbeat(tmp_path)
    heart.beat(time.monotonic_ns())
    assert heartbeat.beats() is not None
    heart.close()
    assert heartbeat.beats() is None


def test_two_processes_cannot_beat_in_one_namespace(tmp_path, process):
    with pytest.raises(MiddlewareError, match=f"process {process.pid} writes here already"):
        statistics(tmp_path)


def test_a_new_process_follows_a_killed_one(tmp_path, process):
    heartbeat = Heartbeat(tmp_path)
    until(heartbeat.alive if heartbeat.beats() else lambda: heartbeat.beats() is not None)
    process.kill()
    process.join(WAIT)
    last = heartbeat.beats()
    time.sleep(0.01)
    assert heartbeat.beats() == last
    assert not heartbeat.alive()
    heart = statistics(tmp_path, 1000.0)
    heart.beat(time.monotonic_ns())
    assert heartbeat.beats() > last
    assert (heartbeat.pid, heartbeat.generation, heartbeat.period) == (os.getpid(), 2, 0.001)


def test_a_stopped_process_is_alive_and_ages(tmp_path, process):
    heartbeat = Heartbeat(tmp_path)
    until(lambda: heartbeat.age() < 0.1)
    os.kill(process.pid, signal.SIGSTOP)
    until(lambda: heartbeat.age() > 0.2)
    assert heartbeat.alive()
    os.kill(process.pid, signal.SIGCONT)
    until(lambda: heartbeat.age() < 0.1)


def test_a_damaged_file_has_no_heartbeat(tmp_path):
    (tmp_path / "statistics").write_bytes(b"something else")
    assert Heartbeat(tmp_path).beats() is None
