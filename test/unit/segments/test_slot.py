"""The newest record of one writer: never torn, never waited for."""

import os
import time

import numpy as np
import pytest
from support.processes import BOUND, process
from support.unit.writers import KIND, WIDTH, die_in_mid_write, flood

from solfer.segments.segment import Segment
from solfer.segments.slot import STATE_WORD, Slot

NEWS = 20_000


@pytest.fixture
def pair():
    memory = memoryview(bytearray(Slot.size(3)))
    return Slot(memory, 3), Slot(memory, 3)


def test_nothing_then_new_then_old(pair):
    writer, reader = pair
    assert not reader.read()
    writer.values[:] = 1.0, np.nan, -np.inf
    writer.write(123456789)
    assert reader.read()
    np.testing.assert_array_equal(reader.values, [1.0, np.nan, -np.inf])
    assert (reader.sequence, reader.stamp) == (1, 123456789)
    assert not reader.read()


def test_of_several_records_the_newest_is_read(pair):
    writer, reader = pair
    for number in range(1, 8):
        writer.values[:] = number
        writer.write(number)
    assert reader.read()
    assert reader.values.tolist() == [7.0, 7.0, 7.0]
    assert reader.sequence == 7


def test_an_unfinished_record_is_not_read(pair):
    writer, reader = pair
    writer.values[:] = 1.0
    writer.write(1)
    assert reader.read()
    writer.values[:] = 2.0
    writer.write(2)
    writer.words[writer._places[0] + STATE_WORD] = 5  # the slot of record 2 is being written again
    assert not reader.read()
    assert reader.values.tolist() == [1.0, 1.0, 1.0]
    assert (reader.sequence, reader.stamp, reader.given_up) == (1, 1, 1)


def test_a_write_neither_waits_nor_sleeps(pair):
    """Half of many writes take less than 0.1 ms, of which a loop of 1 kHz has ten; they need 3 us."""
    writer, _ = pair
    durations = []
    for number in range(1, 200):
        begin = time.perf_counter()
        writer.write(number)
        durations.append(time.perf_counter() - begin)
    assert np.median(durations) < 1e-4


@pytest.mark.slow
def test_a_fast_writer_tears_no_read(tmp_path):
    with process(flood, tmp_path / "pipe"):
        slot = Slot(Segment.attach(tmp_path / "pipe", KIND).data, WIDTH)
        newest = new = 0
        while new < NEWS:
            if not slot.read():
                os.sched_yield()  # on a machine with much to do the writer may have to wait for us
                continue
            new += 1
            assert slot.sequence > newest
            newest = slot.sequence
            assert slot.stamp == newest
            assert (slot.values == newest).all()


@pytest.mark.slow
def test_a_writer_killed_writing_leaves_its_last_record(tmp_path):
    path = tmp_path / "pipe"
    with process(die_in_mid_write, path) as child:
        child.join(BOUND)
        assert child.exitcode == -9
    left = Segment.attach(path, KIND)
    slot = Slot(left.data, WIDTH)
    half = slot._records[4 % 2]
    assert (half[0], half[-1]) == (4.0, 2.0)  # it really died in the middle
    assert slot.read()
    assert (slot.values == 3.0).all()
    assert not left.owned()
    assert Segment.create(path, KIND, b"", Slot.size(WIDTH)).generation == left.generation + 1
