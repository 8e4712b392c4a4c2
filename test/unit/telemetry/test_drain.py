"""Rows of a loop, and the file that another process makes of them."""

import multiprocessing
import os
import resource
import signal
import time
from contextlib import closing

import numpy as np
import pytest

from solfer.errors import MiddlewareError, RecordingError
from solfer.recording.log import Logger
from solfer.recording.model import Event
from solfer.recording.reader import read
from solfer.recording.writer import RecordingWriter
from solfer.telemetry.drain import RecordDrain, writer_of
from solfer.telemetry.recorder import Recorder
from solfer.telemetry.rows import EVENT_COUNT, EVENT_WIDTH

WAIT = 60.0  # [s]


class RecordedLoop:
    """What a loop records."""

    def __init__(self):
        log = Logger("arm")
        self.position, self.inertia, self.counts = np.zeros(3), np.zeros((2, 2)), np.zeros(2, dtype=np.int64)
        log.add("position", self.position, ("a", "b", "c"), "rad")
        log.add("inertia", self.inertia)
        log.add("same", self.position[1:])
        log.add("again", self.position)
        log.add("timing", self.counts, ("read", "write"), "s", factor=1e-9)
        self.sources = log.sources

    def record(self, recorder, first, last):
        for number in range(first, last):
            self.position[:] = number, 2 * number, 3 * number
            self.inertia[:] = number
            self.counts[:] = number, 10 * number
            recorder.append(1_000_000 * number)


@pytest.fixture
def loop():
    return RecordedLoop()


def rows(drain):
    """All new rows: their numbers, their times and the columns."""
    batches = [[part.copy() for part in batch] for batch in drain.batches()]
    return [np.concatenate(parts) for parts in zip(*batches, strict=True)] or [np.zeros(0)] * 3


def test_rows_are_read_back(tmp_path, loop):
    """More rows than a batch arrive in order, to the bit and scaled; an array that is logged twice is stored once."""
    recorder = Recorder(tmp_path, loop.sources, 1000.0)
    drain = RecordDrain(tmp_path)
    loop.record(recorder, 1, 6)
    early = rows(drain)
    loop.record(recorder, 6, 1008)  # more than a batch
    numbers, times, values = (np.concatenate(parts) for parts in zip(early, rows(drain), strict=True))
    assert not list(drain.batches())
    np.testing.assert_array_equal(numbers, np.arange(1, 1008))
    np.testing.assert_array_equal(times, 1_000_000 * numbers)
    np.testing.assert_array_equal(values[:, :3], np.outer(numbers, [1, 2, 3]))
    np.testing.assert_array_equal(values[:, 3:7], np.outer(numbers, np.ones(4)))
    np.testing.assert_array_equal(values[:, 7:12], np.outer(numbers, [2, 3, 1, 2, 3]))
    np.testing.assert_array_equal(values[:, 12:], 1e-9 * np.outer(numbers, [1, 10]))
    assert drain.lost == 0 and drain.count == 1007 and drain.span == pytest.approx((0.001, 1.007))
    assert drain.layout.width == 3 + 4 + 2 + 2  # the same memory with the same size is in a row once


def test_a_recording_begins_with_the_last_seconds(tmp_path, loop):
    recorder = Recorder(tmp_path, loop.sources, 100.0, seconds=0.5)
    loop.record(recorder, 1, 1001)
    drain, later = RecordDrain(tmp_path), RecordDrain(tmp_path)
    later.skip()
    loop.record(recorder, 1001, 1002)
    # 50 rows are kept, and the oldest of them is the one that a live writer would overwrite now
    assert rows(drain)[0].tolist() == list(range(952, 1002))
    assert drain.lost == 0
    assert len(rows(later)[0]) == 1 and later.lost == 0


def test_a_slow_reader_counts_lost_rows(tmp_path, loop):
    recorder = Recorder(tmp_path, loop.sources, 100.0, seconds=0.5)
    drain = RecordDrain(tmp_path)
    loop.record(recorder, 1, 1001)
    numbers, _, values = rows(drain)
    assert len(numbers) + drain.lost == 1000
    assert 48 <= len(numbers) <= 50
    np.testing.assert_array_equal(numbers, values[:, 0])  # where the gap is stays known


def test_a_file_holds_everything(tmp_path, loop):
    """Channels, attachments, metadata and long events are read back from a file that replaces an older one."""
    recorder = Recorder(tmp_path, loop.sources, 1000.0, attachments={"arm/robot.urdf": "<x/>"}, metadata={"seed": "3"})
    drain, path = RecordDrain(tmp_path), tmp_path / "arm.mcap"
    path.write_text("something older")
    loop.record(recorder, 1, 6)
    recorder.event(Event(0.004, "arm", "abort", "because"))
    recorder.event(Event(0.005, "arm", "fault", "long: " + 1000 * "ü"))
    with closing(writer_of(path, [drain])) as writer:
        assert drain.fill() == 5
        writer.finish(drain.lost)
    found = read(path)
    assert set(found.channels) == {f"arm/{name}" for name in ("position", "inertia", "same", "again", "timing")}
    assert found["arm/position"].values.shape == (5, 3) and found["arm/position"].columns == ("a", "b", "c")
    assert 1e9 * found["arm/timing"].values[-1] == pytest.approx([5.0, 50.0]) and found.lost == 0 and not found.missing
    assert found.attachments == {"arm/robot.urdf": b"<x/>"} and found.metadata == {"seed": "3"}
    first, second = found.events
    assert first == Event(0.004, "arm", "abort", "because")
    assert second.kind == "fault" and second.text.startswith("long: üüü") and len(second.text) > EVENT_WIDTH


def test_only_some_plugins_are_drained(tmp_path, loop):
    leg = Logger("leg")
    leg.add("position", loop.inertia[1], unit="m")
    files = {"arm/robot.urdf": "1", "leg/robot.urdf": "2"}
    recorder = Recorder(tmp_path, [*loop.sources, *leg.sources], 1000.0, attachments=files)
    drain = RecordDrain(tmp_path)
    assert drain.plugins == ("arm", "leg")
    loop.record(recorder, 1, 3)
    assert rows(drain.only(["leg"]))[2].tolist() == [[1.0, 1.0], [2.0, 2.0]]
    assert drain.layout.attachments == {"leg/robot.urdf": "2"}


def test_events_that_are_overwritten_do_no_harm(tmp_path, loop):
    recorder = Recorder(tmp_path, loop.sources, 1000.0)
    drain = RecordDrain(tmp_path)
    for number in range(EVENT_COUNT + 10):
        recorder.event(Event(1e-3 * number, "arm", "hold", str(number)))
    texts = [event.text for event in drain.events()]
    assert texts[-1] == str(EVENT_COUNT + 9) and len(texts) >= EVENT_COUNT - 2


def test_a_missing_recording_is_an_error(tmp_path):
    with pytest.raises(MiddlewareError, match="there is no recording"):
        RecordDrain(tmp_path)


def work(folder, ready):
    """Record until the process is killed."""
    loop = RecordedLoop()
    recorder = Recorder(folder, loop.sources, 1000.0)
    loop.record(recorder, 1, 101)
    recorder.event(Event(0.1, "arm", "run"))
    ready.set()
    time.sleep(WAIT)


def test_a_killed_process_leaves_its_last_seconds(tmp_path):
    context = multiprocessing.get_context("fork")
    ready = context.Event()
    process = context.Process(target=work, args=(tmp_path, ready), daemon=True)
    process.start()
    assert ready.wait(WAIT)
    os.kill(process.pid, signal.SIGKILL)
    process.join(WAIT)
    drain = RecordDrain(tmp_path)
    numbers, _, values = rows(drain)
    assert len(numbers) == 100 and drain.over
    assert values[-1, :3].tolist() == [100.0, 200.0, 300.0]
    assert [event.kind for event in drain.events()] == ["run"]


def follow(folder, path, ready):
    """Record and write a file, a chunk after the other, until the process is killed."""
    loop = RecordedLoop()
    recorder = Recorder(folder, loop.sources, 1000.0)
    drain = RecordDrain(folder)
    drain.into(RecordingWriter(path, {"robot.urdf": b"<robot/>"}))
    for first in range(1, 1_000_000, 10):
        loop.record(recorder, first, first + 10)
        drain.fill()
        if first > 500:
            ready.set()


def test_a_killed_recorder_leaves_all_whole_chunks(tmp_path):
    context = multiprocessing.get_context("fork")
    ready, path = context.Event(), tmp_path / "killed.mcap"
    process = context.Process(target=follow, args=(tmp_path, path, ready), daemon=True)
    process.start()
    assert ready.wait(WAIT)
    os.kill(process.pid, signal.SIGKILL)
    process.join(WAIT)
    found = read(path)
    position = found["arm/position"].values
    assert len(position) > 500 and found.lost == 0
    np.testing.assert_array_equal(position[:, 0], np.arange(1, len(position) + 1))
    assert "its writer was killed" in found.missing[-1] and found.attachments


def drain_on_a_full_disk(folder, published):
    """Drain while files may not grow beyond 64 kB for a while, as on a full disk."""
    log, numbers = Logger("arm"), np.zeros(100)
    log.add("noise", numbers)
    recorder = Recorder(folder, log.sources, 1000.0)
    drain = RecordDrain(folder)
    writer = RecordingWriter(folder / "whole.mcap")
    drain.into(writer)
    random = np.random.default_rng(0)

    def record(first, last):
        for number in range(first, last):
            numbers[:] = random.standard_normal(100)
            numbers[0] = number
            recorder.append(1000 * number)

    refusal = ""
    record(1, 41)
    drain.fill()
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, resource.RLIM_INFINITY))
    record(41, 101)
    try:
        drain.fill()
    except RecordingError as error:
        refusal = str(error)
    full = len(read(writer.path)["arm/noise"].times)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    record(101, 201)
    drain.fill()
    writer.finish(drain.lost)
    published.put((refusal, writer.dropped, full))


def test_on_a_full_disk_lost_rows_are_counted(tmp_path):
    context = multiprocessing.get_context("fork")
    published = context.Queue()
    process = context.Process(target=drain_on_a_full_disk, args=(tmp_path, published), daemon=True)
    process.start()
    refusal, dropped, full = published.get(timeout=WAIT)
    process.join(WAIT)
    assert "the recording cannot be written: File too large" in refusal and str(tmp_path) in refusal
    assert dropped == 60 and full == 40
    found = read(tmp_path / "whole.mcap")
    assert found["arm/noise"].values[:, 0].tolist() == [*range(1, 41), *range(101, 201)]
    assert found.lost == 60 and found.missing == ()
