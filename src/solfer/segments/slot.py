"""The newest numbers of one writer, for any number of readers, without a lock.

A seqlock over several slots: the writer fills one after the other, marks a slot as unfinished while it does, and moves
the index last. A reader copies the slot of the index and accepts the copy only if the mark shows that it was not
written meanwhile. Marks and index are words (`words.py`), which keep this order on every processor. Readers and writer
never wait, and a writer that dies in the middle leaves its last whole numbers readable.
"""

import numpy as np

from solfer.segments.header import CACHE_LINE
from solfer.segments.words import words_of

NEWEST = 0
"""Word in front of the slots: number of the newest record."""

TAKEN = 1
"""Word in front of the slots of a ring: number of the record that was read last."""

REFUSED = 2
"""Word in front of the slots of a ring: how many records were refused."""

STATE_WORD = 0
"""Word in front of each slot: twice the number of its record, less one while it is written."""

STAMP_WORD = 1
"""Word in front of each slot: time of the sender [ns]."""


class Slots:
    """Records of float64 in shared memory, one writer.

    Args:
        memory: Content of a segment, of `size` bytes.
        width: Numbers of a record.
        count: Number of slots.

    Attributes:
        values: What was read last, or what `write` sends; private to this process, shape (width,).
        sequence: Number of the record that was read or written last, from 1 on; 0: none yet.
        words: The words in front of the slots, and of each.
        stamp: When it was written, in the writer's clock [ns].
    """

    def __init__(self, memory: memoryview, width: int, count: int):
        self.values = np.zeros(width)
        self.sequence = 0
        self.stamp = 0
        # to copy 50 numbers from view to view takes 60 ns, as arrays 200 ns
        self._content = memoryview(self.values)
        self._copy = memoryview(np.zeros(width))
        self.words = words_of(memory[: self.size(width, count)])
        stride = self._stride(width)
        self._places = [(CACHE_LINE + index * stride) // 8 for index in range(count)]
        begins = [2 * CACHE_LINE + index * stride for index in range(count)]
        self._records = [memory[begin : begin + 8 * width].cast("d") for begin in begins]
        self._count = count

    @classmethod
    def size(cls, width: int, count: int) -> int:
        """Compute the memory that the records need [B]."""
        return CACHE_LINE + count * cls._stride(width)

    @property
    def newest(self) -> int:
        """Number of the newest record; 0: none yet."""
        return self.words[NEWEST]

    def behind(self) -> bool:
        """Return whether there are records that were not read."""
        return self.words[NEWEST] != self.sequence

    @staticmethod
    def _stride(width: int) -> int:
        return CACHE_LINE + -(-8 * width // CACHE_LINE) * CACHE_LINE

    def put(self, stamp: int) -> None:
        """Publish `values` as the next record, `stamp` [ns] in the writer's clock, over the oldest one."""
        words = self.words
        number = self.sequence + 1
        index = number % self._count
        place = self._places[index]
        words[place + STATE_WORD] = 2 * number - 1
        words[place + STAMP_WORD] = stamp
        self._records[index][:] = self._content
        words[place + STATE_WORD] = 2 * number
        words[NEWEST] = number
        self.sequence = number
        self.stamp = stamp

    def fetch(self, number: int) -> bool:
        """Read a record into `values`; returns False, and changes nothing, if it is overwritten meanwhile."""
        words = self.words
        index = number % self._count
        place = self._places[index]
        if words[place + STATE_WORD] != 2 * number:
            return False
        self._copy[:] = self._records[index]
        stamp = words[place + STAMP_WORD]  # here, so that the second look at the mark waits for the numbers
        if words[place + STATE_WORD] != 2 * number:
            return False
        self._content[:] = self._copy
        self.sequence = number
        self.stamp = stamp
        return True


class Slot(Slots):
    """The newest record.

    Attributes:
        given_up: Reads that found a record in every attempt overwritten.
    """

    def __init__(self, memory: memoryview, width: int, count: int = 2):
        super().__init__(memory, width, count)
        self.given_up = 0

    @classmethod
    def size(cls, width: int, count: int = 2) -> int:
        """See `Slots.size`."""
        return super().size(width, count)

    def write(self, stamp: int) -> None:
        """Publish `values`; only the owner of the segment may.

        Args:
            stamp: Time in the writer's clock [ns].
        """
        self.put(stamp)

    def read(self) -> bool:
        """Fetch the newest record into `values`; returns False if there is none that was not read.

        Does not block; keeps what it has if the writer is too fast.
        """
        number = self.words[NEWEST]
        if number == self.sequence:
            return False
        for _ in range(8):  # then the writer is too fast, and this read finds nothing new
            if self.fetch(number):
                return True
            number = self.words[NEWEST]
        self.given_up += 1
        return False
