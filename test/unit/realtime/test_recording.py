"""Records of a loop, and the file that another process makes from them."""

import multiprocessing
import os
import resource
import signal
import time

import numpy as np
import pytest

from solfer.errors import MiddlewareError
from solfer.realtime.telemetry.recorder import Recorder
from solfer.realtime.telemetry.recording import Recording

WAIT = 60.0  # [s]


@pytest.fixture
def sources():
    return {"position": np.zeros(3), "inertia": np.zeros((2, 2))}


@pytest.fixture
def recording(tmp_path):
    """Return a function that opens a recording, which is closed at the end."""
    opened = []

    def opens():
        opened.append(Recording(tmp_path))
        return opened[-1]

    yield opens
    for each in opened:
        each.close()


def record(recorder, sources, first, last):
    for number in range(first, last):
        sources["position"][:] = number, 2 * number, 3 * number
        sources["inertia"][:] = number
        recorder.record(1_000_000 * number)


def test_records_are_read_back(tmp_path, sources, recording):
    recorder = Recorder(tmp_path, sources, 1000.0)
    reader = recording()
    record(recorder, sources, 1, 6)
    assert reader.drain() == 5
    record(recorder, sources, 6, 1008)  # more than a batch
    assert reader.drain() == 1002 and reader.drain() == 0
    found = reader.arrays()
    np.testing.assert_allclose(found["time"], np.arange(1, 1008) * 1e-3)
    np.testing.assert_array_equal(found["cycle"], np.arange(1, 1008))
    np.testing.assert_array_equal(found["position"], np.outer(np.arange(1, 1008), [1, 2, 3]))
    assert found["inertia"].shape == (1007, 2, 2)
    assert reader.lost == 0 and reader.count == 1007


def test_a_recording_begins_with_the_last_seconds(tmp_path, sources, recording):
    recorder = Recorder(tmp_path, sources, 100.0, seconds=0.5)
    record(recorder, sources, 1, 1001)
    reader, later = recording(), recording()
    later.skip()
    record(recorder, sources, 1001, 1002)
    reader.drain()
    # 50 records are kept, and the oldest of them is the one that a live writer would overwrite now
    assert reader.arrays()["cycle"].tolist() == list(range(952, 1002))
    assert reader.lost == 0
    assert later.drain() == 1 and later.lost == 0


def test_a_slow_reader_counts_lost_records(tmp_path, sources, recording):
    recorder = Recorder(tmp_path, sources, 100.0, seconds=0.5)
    reader = recording()
    record(recorder, sources, 1, 1001)
    drained = reader.drain()
    assert drained + reader.lost == 1000
    assert 48 <= drained <= 50
    found = reader.arrays()
    assert found["position"][-1, 0] == 1000
    np.testing.assert_array_equal(found["cycle"], found["position"][:, 0])  # where the gap is stays known


def test_a_file_holds_everything(tmp_path, sources, recording):
    recorder = Recorder(tmp_path, sources, 1000.0, labels={"joints": ("a", "b", "c")})
    reader, path = recording(), tmp_path / "arm.npz"
    path.write_text("something older")
    record(recorder, sources, 1, 6)
    reader.drain()
    reader.save(path)
    with np.load(path) as found:
        assert set(found) == {"time", "cycle", "position", "inertia", "lost", "joints"}
        assert found["position"].shape == (5, 3) and found["lost"] == 0
        assert found["joints"].tolist() == ["a", "b", "c"]
    assert [file.name for file in tmp_path.glob("arm*")] == ["arm.npz"]


def test_a_recording_without_a_cycle_is_empty(tmp_path, sources, recording):
    Recorder(tmp_path, sources, 1000.0)
    reader = recording()
    assert reader.drain() == 0
    reader.save(tmp_path / "arm.npz")
    with np.load(tmp_path / "arm.npz") as found:
        assert found["position"].shape == (0, 3)


def test_a_file_that_cannot_be_written_is_named(tmp_path, sources, recording):
    Recorder(tmp_path, sources, 1000.0)
    with pytest.raises(MiddlewareError, match="the recording cannot be written: No such file or directory"):
        recording().save(tmp_path / "nowhere" / "arm.npz")
    with pytest.raises(MiddlewareError, match="the recording cannot be written: No such file or directory"):
        Recording(tmp_path, tmp_path / "nowhere")


def test_a_missing_recording_is_an_error(tmp_path):
    with pytest.raises(MiddlewareError, match="there is no recording"):
        Recording(tmp_path)


def work(folder, ready):
    """Record until the process is killed."""
    sources = {"position": np.zeros(3), "inertia": np.zeros((2, 2))}
    recorder = Recorder(folder, sources, 1000.0)
    record(recorder, sources, 1, 101)
    ready.set()
    time.sleep(WAIT)


def test_a_killed_process_leaves_its_last_seconds(tmp_path, recording):
    context = multiprocessing.get_context("fork")
    ready = context.Event()
    process = context.Process(target=work, args=(tmp_path, ready), daemon=True)
    process.start()
    assert ready.wait(WAIT)
    os.kill(process.pid, signal.SIGKILL)
    process.join(WAIT)
    reader = recording()
    assert reader.drain() == 100
    assert reader.over
    assert reader.arrays()["position"][-1].tolist() == [100.0, 200.0, 300.0]


def drain_on_a_full_disk(folder, published):
    """Drain while files may not grow beyond 64 kB for a while, as on a full disk."""
    sources = {"position": np.zeros(100)}
    recorder = Recorder(folder, sources, 1000.0)
    reader = Recording(folder, folder)

    def record(first, last):
        for number in range(first, last):
            sources["position"][:] = number
            recorder.record(number)

    refusal = refusal_to_save = ""
    record(1, 81)  # as many as there is room for, but not in the file that is to be made of them
    reader.drain()
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, resource.RLIM_INFINITY))
    record(81, 101)
    try:
        reader.drain()
    except MiddlewareError as error:
        refusal = str(error)
    try:
        reader.save(folder / "full.npz")
    except MiddlewareError as error:
        refusal_to_save = str(error)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    record(101, 201)
    reader.drain()
    reader.save(folder / "whole.npz")
    published.put((refusal, refusal_to_save, reader.lost))


def test_on_a_full_disk_lost_records_are_counted(tmp_path):
    context = multiprocessing.get_context("fork")
    published = context.Queue()
    process = context.Process(target=drain_on_a_full_disk, args=(tmp_path, published), daemon=True)
    process.start()
    refusal, refusal_to_save, lost = published.get(timeout=WAIT)
    process.join(WAIT)
    assert "the recording cannot be written: File too large" in refusal and str(tmp_path) in refusal
    assert "full.npz: the recording cannot be written: File too large" in refusal_to_save
    assert lost == 20
    with np.load(tmp_path / "whole.npz") as found:
        assert found["cycle"].tolist() == [*range(1, 81), *range(101, 201)]
        np.testing.assert_array_equal(found["position"][:, 99], found["cycle"])
        assert found["lost"] == 20
    assert not list(tmp_path.glob("full*"))
