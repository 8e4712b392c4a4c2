"""Beats of a process in shared memory, seen by another one."""

import multiprocessing
import os
import signal
import time

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.xbot import heartbeat
from solfer.middleware.xbot.board import Board
from solfer.middleware.xbot.heartbeat import Pulse

WAIT = 30.0  # [s]


@pytest.fixture(autouse=True)
def _look_at_once(monkeypatch):
    monkeypatch.setattr(heartbeat, "LOOK", 0.0)


def board(folder, rate=500.0):
    """What an executor beats on."""
    return Board.create(folder, rate, ["plugin"], ["component"])


def beat(folder, ready):
    """A process that beats until it is killed."""
    heart = board(folder)
    while True:
        heart.beat(time.monotonic_ns())
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
    pulse = Pulse(tmp_path)
    assert pulse.beats() is None
    assert pulse.age() == float("inf")
    assert not pulse.alive()


def test_beats_change_and_say_how_often(tmp_path):
    heart, pulse = board(tmp_path), Pulse(tmp_path)
    assert pulse.beats() is None
    heart.beat(time.monotonic_ns())
    first = pulse.beats()
    heart.beat(time.monotonic_ns())
    assert pulse.beats() > first
    assert (pulse.pid, pulse.generation, pulse.period) == (os.getpid(), 1, 0.002)
    assert pulse.alive()


def test_an_orderly_end_is_no_silence(tmp_path):
    heart, pulse = board(tmp_path), Pulse(tmp_path)
    heart.beat(time.monotonic_ns())
    assert pulse.beats() is not None
    heart.close()
    assert pulse.beats() is None


def test_two_processes_cannot_beat_in_one_namespace(tmp_path, process):
    with pytest.raises(MiddlewareError, match=f"process {process.pid} writes here already"):
        board(tmp_path)


def test_a_killed_process_leaves_its_last_beat_and_a_new_one_is_found(tmp_path, process):
    pulse = Pulse(tmp_path)
    until(pulse.alive if pulse.beats() else lambda: pulse.beats() is not None)
    process.kill()
    process.join(WAIT)
    last = pulse.beats()
    time.sleep(0.01)
    assert pulse.beats() == last
    assert not pulse.alive()
    heart = board(tmp_path, 1000.0)
    heart.beat(time.monotonic_ns())
    assert pulse.beats() > last
    assert (pulse.pid, pulse.generation, pulse.period) == (os.getpid(), 2, 0.001)


def test_a_stopped_process_is_alive_and_grows_old(tmp_path, process):
    pulse = Pulse(tmp_path)
    until(lambda: pulse.age() < 0.1)
    os.kill(process.pid, signal.SIGSTOP)
    until(lambda: pulse.age() > 0.2)
    assert pulse.alive()
    os.kill(process.pid, signal.SIGCONT)
    until(lambda: pulse.age() < 0.1)


def test_a_damaged_file_is_no_process(tmp_path):
    (tmp_path / "statistics").write_bytes(b"something else")
    assert Pulse(tmp_path).beats() is None
