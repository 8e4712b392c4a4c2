"""Every record of one writer in its order, in fixed memory."""

import sys

from solfer.segments.slot import NEWEST, REFUSED, TAKEN, Slots


class Ring(Slots):
    """Records one after the other; see `Slots` for what is protected how.

    A ring that overwrites serves any number of readers, each of which counts what it has lost. A ring that refuses has
    one reader, which has attached the segment as writable: nothing is lost behind the writer's back.

    Args:
        memory: Content of a segment, of `size` bytes.
        width: Numbers of a record.
        count: Records that it holds.
        refuse: Whether `write` refuses when the reader has not read what is there, instead of overwriting it.

    Attributes:
        lost: Records that were overwritten before this reader read them.
    """

    def __init__(self, memory: memoryview, width: int, count: int, refuse: bool = False):
        super().__init__(memory, width, count)
        self.lost = 0
        self._refuse = refuse
        if refuse:
            self.sequence = self.words[TAKEN]

    @property
    def refused(self) -> int:
        """Records that the writer could not place since the segment was made."""
        return self.words[REFUSED]

    def write(self, stamp: int) -> bool:
        """Append `values`; only the owner of the segment may.

        Args:
            stamp: Time in the writer's clock [ns].

        Returns:
            False if the ring is full and refuses; then it was counted.
        """
        if self._refuse and self.sequence - self.words[TAKEN] >= self._count:
            self.words[REFUSED] += 1
            return False
        self.put(stamp)
        return True

    def read(self, most: int = sys.maxsize) -> bool:
        """Fetch the next record into `values`; returns False if there is none. Does not block.

        Records that were overwritten are left out and counted, and so are all but the newest `most`.
        """
        if self.words[NEWEST] - self.sequence > most:
            self.limit(most)
        while self.sequence < (newest := self.words[NEWEST]):
            if self.fetch(self.sequence + 1):
                if self._refuse:
                    self.words[TAKEN] = self.sequence
                return True
            if self._refuse:
                return False
            kept = max(newest - self._count + 2, self.sequence + 2)
            self.lost += kept - 1 - self.sequence
            self.sequence = kept - 1
        return False

    def limit(self, count: int) -> None:
        """Leave out, as a reader, all but the newest `count` records; those that were not read count as lost."""
        surplus = self.words[NEWEST] - self.sequence - count
        if surplus > 0:
            self.lost += surplus
            self.sequence += surplus

    def resume(self) -> None:
        """Continue, as a writer, behind what another one, which has ended, wrote last."""
        self.sequence = self.words[NEWEST]

    def skip(self) -> None:
        """Leave out, as a reader, all that is there; it does not count as lost."""
        self.sequence = self.words[NEWEST]
        if self._refuse:
            self.words[TAKEN] = self.sequence
