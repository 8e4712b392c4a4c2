"""Rows that are gathered from arrays, wherever they lie, into a ring that others read."""

import mmap

import numpy as np
import pytest
from support.allocations import check_that_it_keeps_no_memory

from solfer.recording.log import Logger
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.telemetry.recorder import Recorder
from solfer.telemetry.rows import RECORDING

SIGNALLING = 0x7FF0000000000001
"""Bits of a NaN that most arithmetic would change."""

COUNT = 4


def made(folder, arrays: list[np.ndarray]) -> tuple[Recorder, Ring]:
    """Return both ends of a ring of four rows."""
    log = Logger("arm")
    for index, array in enumerate(arrays):
        log.add(str(index), array)
    recorder = Recorder(folder, log.sources, COUNT, seconds=1.0)
    segment = Segment.attach(folder / RECORDING, RECORDING)
    return recorder, Ring(segment.data, sum(array.size for array in arrays), COUNT)


def test_rows_are_the_arrays_as_they_were(tmp_path):
    far = np.frombuffer(mmap.mmap(-1, mmap.PAGESIZE))  # another part of the address space
    whole, counts = np.zeros(10), np.zeros(2, dtype=np.int64)
    arrays = [far[3:5], whole[2:4], counts, np.zeros(0), whole[:2], np.zeros((2, 2))]
    recorder, reader = made(tmp_path, arrays)
    for number in range(3 * COUNT):
        for place, array in enumerate(arrays):
            array[...] = number + place
        counts[1] = SIGNALLING
        recorder.append(10 * number)
        lying = sorted(arrays, key=lambda array: array.ctypes.data)
        expected = np.concatenate([array.reshape(-1).view(np.int64) for array in lying])
        assert reader.read() and reader.stamp == 10 * number
        np.testing.assert_array_equal(reader.values.view(np.int64), expected)
    assert not reader.read() and not reader.lost


def test_a_slow_reader_counts_lost_rows(tmp_path):
    values = np.zeros(3)
    recorder, reader = made(tmp_path, [values])
    for number in range(10):
        values[:] = number
        recorder.append(number)
    rows = [reader.values[0] for _ in range(COUNT) if reader.read()]
    assert rows == [7.0, 8.0, 9.0]  # the oldest of four may be overwritten while it is read
    assert reader.lost == 7


@pytest.mark.parametrize("arrays", [[], [np.zeros(0)]], ids=["none", "empty"])
def test_rows_without_numbers_are_counted(tmp_path, arrays):
    recorder, reader = made(tmp_path, arrays)
    recorder.append(7)
    assert reader.read() and (reader.sequence, reader.stamp) == (1, 7)


def test_recording_keeps_no_memory(tmp_path):
    recorder, _ = made(tmp_path, [np.zeros(50), np.zeros(3)])
    check_that_it_keeps_no_memory(lambda: recorder.append(1))
