"""The ring of rows of a recording: a row is gathered from many arrays and published by one compiled call."""

from collections.abc import Sequence

import numpy as np

from solfer.middleware.shared_memory.memory.header import HEADER_LINE
from solfer.middleware.shared_memory.memory.ring import Ring
from solfer.middleware.shared_memory.memory.slot import NEWEST, SLOT_STAMP, SLOT_STATE
from solfer.numerics.compilation import cached
from solfer.numerics.pointers import Memory, indices_at, record_at, release_fence

ROW_RING = np.dtype(
    [
        # addresses of the arrays and their sizes, in memory of their own, and how many there are
        *((name, np.int64) for name in ("arrays", "sizes", "pieces")),
        # the ring: its memory and its words, how many rows it holds, the words from one to the next
        *((name, np.int64) for name in ("words", "size", "count", "stride")),
        ("number", np.int64),
    ]
)
"""What `append` reads, and the number of the row that it wrote last; see `solfer.numerics.pointers.Memory`."""

_ring_at = record_at(ROW_RING)


def _append(address, stamp):
    """Publish the arrays as they are now as the next row; in the order that `Slots` protects."""
    ring = _ring_at(address)
    words = indices_at(ring.words, ring.size)
    arrays = indices_at(ring.arrays, ring.pieces)
    sizes = indices_at(ring.sizes, ring.pieces)
    number = ring.number + 1
    slot = HEADER_LINE // 8 + (number % ring.count) * ring.stride
    words[slot + SLOT_STATE] = 2 * number - 1
    words[slot + SLOT_STAMP] = stamp
    release_fence()
    place = slot + HEADER_LINE // 8
    for piece in range(ring.pieces):
        array = indices_at(arrays[piece], sizes[piece])
        for index in range(sizes[piece]):
            words[place + index] = array[index]
        place += sizes[piece]
    release_fence()
    words[slot + SLOT_STATE] = 2 * number
    release_fence()
    words[NEWEST] = number
    ring.number = number


append = cached("void(int64, int64)", _append)


class RowRing:
    """The writing end of a `Ring` that overwrites; its readers use `Ring`.

    To gather a row here and not in `Ring.values`, without a word of Python in between, takes a third of the time where
    the processor has to fetch code and numbers again, as in a loop that sleeps between its cycles.

    Args:
        memory: Content of a segment, of `Ring.size` bytes.
        arrays: Contiguous arrays of eight bytes a number, which stay where they are; what is copied are their bits.
        count: Rows that it holds.
    """

    def __init__(self, memory: memoryview, arrays: Sequence[np.ndarray], count: int):
        # they live as long as the ring
        self._arrays = [each for each in (array.reshape(-1).view(np.int64) for array in arrays) if each.size]
        width = sum(array.size for array in self._arrays)
        words = np.frombuffer(memory[: Ring.size(width, count)], dtype=np.int64)
        self._memory = Memory(
            ROW_RING,
            arrays=np.array([array.ctypes.data for array in self._arrays], dtype=np.int64),
            sizes=np.array([array.size for array in self._arrays], dtype=np.int64),
            pieces=len(self._arrays),
            words=words,
            size=words.size,
            count=count,
            stride=(Ring.size(width, count) - HEADER_LINE) // (8 * count),
            number=0,
        )
        self._address = self._memory.address

    def append(self, stamp: int) -> None:
        """Publish the arrays as they are now, `stamp` [ns] in the writer's clock, over the oldest row."""
        append(self._address, stamp)
