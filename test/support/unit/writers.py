"""Processes that own shared memory, and end as a test needs it."""

import os
import signal
import time

from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.segments.slot import Slot

KIND, LAYOUT = "test", b'{"names": ["a", "b"]}'
WIDTH = 150


def hold(path, ready):
    """Own a segment with one record for ever."""
    segment = Segment.create(path, KIND, LAYOUT, Slot.size(WIDTH))
    slot = Slot(segment.data, WIDTH)
    slot.values[:] = 7.0
    slot.write(1)
    ready.set()
    time.sleep(1e6)


def flood(path, ready):
    """Write records at full speed, each of one number only."""
    segment = Segment.create(path, KIND, LAYOUT, Slot.size(WIDTH))
    slot = Slot(segment.data, WIDTH)
    while True:
        slot.values[:] = slot.sequence + 1
        slot.write(slot.sequence + 1)
        ready.set()


def flood_ring(path, ready, count, refuse):
    """Write records into a ring at full speed, each of one number only."""
    segment = Segment.create(path, KIND, LAYOUT, Ring.size(WIDTH, count))
    ring = Ring(segment.data, WIDTH, count, refuse)
    while True:
        ring.values[:] = ring.sequence + 1
        ring.write(ring.sequence + 1)
        ready.set()


def die_in_mid_write(path, ready):
    """Write three records, and die by SIGKILL with the fourth half written."""
    segment = Segment.create(path, KIND, LAYOUT, Slot.size(WIDTH))
    slot = Slot(segment.data, WIDTH)
    for number in (1, 2, 3):
        slot.values[:] = number
        slot.write(number)
    ready.set()

    class Half:
        def __setitem__(self, whole, values):
            record[: WIDTH // 2] = values[: WIDTH // 2]
            os.kill(os.getpid(), signal.SIGKILL)

    record = slot._records[4 % 2]
    slot._records[4 % 2] = Half()
    slot.values[:] = 4
    slot.write(4)
