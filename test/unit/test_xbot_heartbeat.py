"""Beats of a process in shared memory, seen by another one."""

import multiprocessing
import os
import signal
import time

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.xbot import heartbeat
from solfer.middleware.xbot.heartbeat import Heart, Pulse

WAIT = 30.0  # [s]


@pytest.fixture(autouse=True)
def _look_at_once(monkeypatch):
    monkeypatch.setattr(heartbeat, "LOOK", 0.0)


def beat(folder, ready):
    """A process that beats until it is killed."""
    heart = Heart(folder, "xbot", 0.002)
    while True:
        heart.beat()
        ready.set()
        time.sleep(0.002)


@pytest.fixture
def process(tmp_path):
    """A process that beats."""
    context = multiprocessing.get_context("fork")
    ready = context.Event()
    made = context.Process(target=beat, args=(tmp_path, ready), daemon=True)
    made.start()
    assert ready.wait(WAIT)
    yield made
    made.kill()
    made.join(WAIT)


def until(condition):
    """Wait for a condition."""
    end = time.monotonic() + WAIT
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def test_without_a_process_there_are_no_beats(tmp_path):
    pulse = Pulse(tmp_path, "xbot")
    assert pulse.beats() is None
    assert pulse.age() == float("inf")
    assert not pulse.alive()


def test_beats_change_and_say_how_often(tmp_path):
    heart, pulse = Heart(tmp_path, "xbot", 0.002), Pulse(tmp_path, "xbot")
    assert pulse.beats() is None
    heart.beat()
    first = pulse.beats()
    heart.beat()
    assert pulse.beats() > first
    assert (pulse.pid, pulse.generation, pulse.period) == (os.getpid(), 1, 0.002)
    assert pulse.alive()


def test_an_orderly_end_is_no_silence(tmp_path):
    heart, pulse = Heart(tmp_path, "xbot", 0.002), Pulse(tmp_path, "xbot")
    heart.beat()
    assert pulse.beats() is not None
    heart.close()
    assert pulse.beats() is None


def test_two_processes_cannot_beat_under_one_name(tmp_path, process):
    with pytest.raises(MiddlewareError, match=f"process {process.pid} writes here already"):
        Heart(tmp_path, "xbot", 0.002)


def test_a_killed_process_leaves_its_last_beat_and_a_new_one_is_found(tmp_path, process):
    pulse = Pulse(tmp_path, "xbot")
    until(pulse.alive if pulse.beats() else lambda: pulse.beats() is not None)
    process.kill()
    process.join(WAIT)
    last = pulse.beats()
    time.sleep(0.01)
    assert pulse.beats() == last
    assert not pulse.alive()
    heart = Heart(tmp_path, "xbot", 0.001)
    heart.beat()
    assert pulse.beats() > last
    assert (pulse.pid, pulse.generation, pulse.period) == (os.getpid(), 2, 0.001)


def test_a_stopped_process_is_alive_and_grows_old(tmp_path, process):
    pulse = Pulse(tmp_path, "xbot")
    until(lambda: pulse.age() < 0.1)
    os.kill(process.pid, signal.SIGSTOP)
    until(lambda: pulse.age() > 0.2)
    assert pulse.alive()
    os.kill(process.pid, signal.SIGCONT)
    until(lambda: pulse.age() < 0.1)


def test_a_damaged_file_is_no_process(tmp_path):
    (tmp_path / "heart.xbot").write_bytes(b"something else")
    assert Pulse(tmp_path, "xbot").beats() is None
