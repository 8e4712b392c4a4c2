"""Every record of one writer in its order."""

import os

import pytest
from support.processes import process
from support.unit.writers import KIND, WIDTH, flood_ring

from solfer.segments.ring import Ring
from solfer.segments.segment import Segment

COUNT = 4
RECORDS = 20_000


def ring_pair(refuse=False):
    memory = memoryview(bytearray(Ring.size(2, COUNT)))
    return Ring(memory, 2, COUNT, refuse), Ring(memory, 2, COUNT, refuse)


def put(ring, *numbers):
    """Write records of one number each; returns how many were accepted."""
    done = 0
    for number in numbers:
        ring.values[:] = number
        done += ring.write(int(number))
    return done


def all_of(ring):
    """Read all records that are there."""
    numbers = []
    while ring.read():
        assert ring.values[0] == ring.values[1] == ring.stamp
        numbers.append(ring.stamp)
    return numbers


def test_records_come_in_their_order():
    writer, reader = ring_pair()
    assert all_of(reader) == []
    put(writer, 1, 2, 3)
    assert all_of(reader) == [1, 2, 3]
    put(writer, 4)
    assert all_of(reader) == [4]
    assert reader.lost == 0


def test_every_reader_gets_all():
    memory = memoryview(bytearray(Ring.size(2, COUNT)))
    writer, first, second = (Ring(memory, 2, COUNT) for _ in range(3))
    put(writer, 1, 2)
    assert all_of(first) == all_of(second) == [1, 2]


def test_a_slow_reader_counts_the_records_it_loses():
    writer, reader = ring_pair()
    put(writer, *range(1, 11))
    numbers = all_of(reader)
    assert numbers == list(range(11 - len(numbers), 11))
    assert numbers and reader.lost + len(numbers) == 10


def test_a_full_ring_refuses_until_there_is_room():
    writer, reader = ring_pair(refuse=True)
    assert put(writer, *range(1, 7)) == COUNT
    assert writer.refused == reader.refused == 2
    assert all_of(reader) == [1, 2, 3, 4]
    assert put(writer, 7) == 1
    assert all_of(reader) == [7]
    assert reader.lost == 0


def test_what_is_skipped_does_not_count_as_lost():
    writer, reader = ring_pair()
    put(writer, 1, 2, 3)
    reader.skip()
    put(writer, 4)
    assert all_of(reader) == [4]
    assert reader.lost == 0


def test_what_is_skipped_makes_room():
    writer, reader = ring_pair(refuse=True)
    assert put(writer, *range(1, 6)) == COUNT
    reader.skip()
    assert put(writer, 6, 7, 8, 9, 10) == COUNT and writer.refused == 2
    assert all_of(reader) == [6, 7, 8, 9] and reader.lost == 0


@pytest.mark.slow
@pytest.mark.parametrize("refuse", [False, True], ids=["overwrites", "refuses"])
def test_a_fast_writer_tears_and_hides_no_record(tmp_path, refuse):
    count = 64
    with process(flood_ring, tmp_path / "ring", count, refuse):
        segment = Segment.attach(tmp_path / "ring", KIND, writable=refuse)
        ring = Ring(segment.data, WIDTH, count, refuse)
        read = 0
        while read < RECORDS:
            if not ring.read():
                os.sched_yield()  # on a machine with much to do the writer may have to wait for us
                continue
            read += 1
            assert ring.stamp == ring.sequence == read + ring.lost
            assert (ring.values == ring.stamp).all()
    assert ring.lost == 0 or not refuse
