"""What a loop takes down, and what another process makes of it."""

import multiprocessing
import os
import signal
import time

import numpy as np
import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.recording import Recorder, Recording

WAIT = 30.0  # [s]


@pytest.fixture
def sources():
    return {"position": np.zeros(3), "inertia": np.zeros((2, 2))}


def record(recorder, sources, first, last):
    for number in range(first, last):
        sources["position"][:] = number, 2 * number, 3 * number
        sources["inertia"][:] = number
        recorder.take(1_000_000 * number)


def test_what_was_taken_down_is_found_again(tmp_path, sources):
    recorder = Recorder(tmp_path, "arm", sources, 1000.0)
    recording = Recording(tmp_path, "arm")
    record(recorder, sources, 1, 6)
    assert recording.drain() == 5
    record(recorder, sources, 6, 8)
    assert recording.drain() == 2
    found = recording.arrays()
    np.testing.assert_allclose(found["time"], np.arange(1, 8) * 1e-3)
    np.testing.assert_array_equal(found["position"], np.outer(np.arange(1, 8), [1, 2, 3]))
    assert found["inertia"].shape == (7, 2, 2)
    assert recording.lost == 0


def test_one_who_is_slow_loses_what_is_old_and_counts_it(tmp_path, sources):
    recorder = Recorder(tmp_path, "arm", sources, 100.0, seconds=0.5)
    recording = Recording(tmp_path, "arm")
    record(recorder, sources, 1, 1001)
    drained = recording.drain()
    assert drained + recording.lost == 1000
    assert 48 <= drained <= 50
    assert recording.arrays()["position"][-1, 0] == 1000


def test_a_file_holds_everything(tmp_path, sources):
    recorder = Recorder(tmp_path, "arm", sources, 1000.0)
    recording = Recording(tmp_path, "arm")
    record(recorder, sources, 1, 6)
    recording.drain()
    recording.save(tmp_path / "arm.npz")
    with np.load(tmp_path / "arm.npz") as found:
        assert set(found) == {"time", "position", "inertia", "lost"}
        assert found["position"].shape == (5, 3)


def test_a_file_that_cannot_be_written_is_named(tmp_path, sources):
    recorder = Recorder(tmp_path, "arm", sources, 1000.0)
    with pytest.raises(MiddlewareError, match="the recording cannot be written: No such file or directory"):
        Recording(tmp_path, "arm").save(tmp_path / "nowhere" / "arm.npz")
    recorder.close()


def test_nobody_records(tmp_path):
    with pytest.raises(MiddlewareError, match="cannot be opened"):
        Recording(tmp_path, "arm")


def work(folder, ready):
    """A process that records until it is killed."""
    sources = {"position": np.zeros(3), "inertia": np.zeros((2, 2))}
    recorder = Recorder(folder, "arm", sources, 1000.0)
    record(recorder, sources, 1, 101)
    ready.set()
    time.sleep(WAIT)


def test_the_last_seconds_of_a_killed_process_are_left(tmp_path):
    context = multiprocessing.get_context("fork")
    ready = context.Event()
    process = context.Process(target=work, args=(tmp_path, ready), daemon=True)
    process.start()
    assert ready.wait(WAIT)
    os.kill(process.pid, signal.SIGKILL)
    process.join(WAIT)
    recording = Recording(tmp_path, "arm")
    assert recording.drain() == 100
    assert recording.over
    assert recording.arrays()["position"][-1].tolist() == [100.0, 200.0, 300.0]
