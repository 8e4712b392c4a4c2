"""The newest samples of a sensor, in the order of their stamps."""

import math

import numpy as np


class SortedSamples:
    """The newest samples of a sensor, in the order of their stamps.

    Args:
        capacity: Largest number of samples; the oldest is dropped for a new one.
        width: Numbers of a sample.

    Attributes:
        count: Number of samples.
        stamps: Their stamps, shape (capacity,) [s].
        rows: Their numbers, shape (capacity, width).
    """

    def __init__(self, capacity: int, width: int):
        self.count = 0
        self.stamps = np.zeros(capacity)
        self.rows = np.zeros((capacity, width))

    @property
    def newest(self) -> float:
        """Stamp of the newest sample [s]; minus infinity without one."""
        return float(self.stamps[self.count - 1]) if self.count else -math.inf

    def insert(self, stamp: float) -> int:
        """Make room for a sample; return its row, or -1 where there is one with that stamp, or it is too old."""
        stamps = self.stamps
        rows = self.rows
        row = self.count
        is_full = self.count == len(stamps)
        while row and stamps[row - 1] > stamp:
            row -= 1
        if row == 0 and is_full or row and stamps[row - 1] == stamp:
            return -1
        if is_full:
            self.drop(1)
            row -= 1
        stamps[row + 1 : self.count + 1] = stamps[row : self.count]
        rows[row + 1 : self.count + 1] = rows[row : self.count]
        stamps[row] = stamp
        self.count += 1
        return row

    def drop(self, number: int) -> None:
        """Forget the oldest samples, so many of them."""
        if not number:
            return
        self.count -= number
        self.stamps[: self.count] = self.stamps[number : self.count + number]
        self.rows[: self.count] = self.rows[number : self.count + number]
