"""Figures of a loop in fixed memory: histograms of times, and counters that forgive."""

import numpy as np

UNIT = 6  # shortest time that is told apart, as a power of two [ns]
FINE = 4  # buckets in each doubling of the time, as a power of two
BUCKETS = 400
"""Buckets of a histogram: up to 4 s, each at most 1/16 wide; the last one takes the rest."""

WIDTH = BUCKETS + 2
"""Words of a histogram: the number of times, the longest one [ns], then the buckets."""


def bucket_of(nanoseconds: int) -> int:
    """Index of the bucket of a time [ns]."""
    units, octave = max(nanoseconds >> UNIT, 0), 0
    while units >> octave >= 2 << FINE:
        octave += 1
    return min((octave << FINE) + (units >> octave), BUCKETS - 1)


def upper_edge(bucket: int) -> int:
    """Where the times of a bucket end [ns]."""
    following = bucket + 1
    octave = max((following >> FINE) - 1, 0)
    return (following - (octave << FINE)) << (octave + UNIT)


class Histograms:
    """Rows of histograms over one stretch of memory, which other processes may read while they are filled.

    Args:
        memory: int64, shape (rows * WIDTH,); zeros before the first time.

    Attributes:
        rows: The same memory, shape (rows, WIDTH); `tally` counts there.
    """

    def __init__(self, memory: np.ndarray):
        self.rows = memory.reshape(-1, WIDTH)

    def snapshot(self) -> np.ndarray:
        """All that was counted so far, int64, shape (rows, WIDTH)."""
        return self.rows.copy()

    def since(self, earlier: np.ndarray) -> "Histograms":
        """What was counted since a snapshot; the longest times are those of the whole run."""
        rows = self.rows - earlier
        rows[:, 1] = self.rows[:, 1]
        return Histograms(rows)

    def count(self, row: int) -> int:
        """How many times were counted."""
        return int(self.rows[row, 0])

    def longest(self, row: int) -> int:
        """The longest time [ns]; 0 before the first."""
        return int(self.rows[row, 1])

    def quantile(self, row: int, share: float) -> int:
        """A time that at least `share` of all times do not exceed [ns]; at most 1/16 too long, and 0 without any."""
        sums = np.cumsum(self.rows[row, 2:])
        if not sums[-1]:
            return 0
        bucket = int(np.searchsorted(sums, share * sums[-1]))
        return min(upper_edge(bucket), self.longest(row))


class LeakyCounter:
    """Counts what should not happen often: each good turn forgives one bad one.

    Args:
        limit: Count at which it is too often.

    Attributes:
        count: Bad turns that are not forgiven.
        total: All bad turns.
    """

    def __init__(self, limit: int):
        self.limit, self.count, self.total = limit, 0, 0

    def add(self, bad: bool) -> bool:
        """A turn is over; returns whether it is too often now."""
        if bad:
            self.count += 1
            self.total += 1
        elif self.count:
            self.count -= 1
        return self.count >= self.limit

    def reset(self) -> None:
        """Forgive everything."""
        self.count = 0
