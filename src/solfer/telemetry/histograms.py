"""Statistics of a loop in fixed memory: histograms of durations."""

import numpy as np

HISTOGRAM_UNIT = 6  # resolution of the shortest times, as a power of two [ns]
FINE = 4  # buckets in each doubling of the time, as a power of two
BUCKETS = 400
"""Buckets of a histogram: up to 4 s, each at most 1/16 wide; longer times count in the last one."""

HISTOGRAM_WORDS = BUCKETS + 2
"""Words of a histogram: the number of times, the longest one [ns], then the buckets."""


def bucket_of(nanoseconds: int) -> int:
    """Compute the index of the bucket of a time [ns]."""
    units = max(nanoseconds >> HISTOGRAM_UNIT, 0)
    octave = 0
    while units >> octave >= 2 << FINE:
        octave += 1
    return min((octave << FINE) + (units >> octave), BUCKETS - 1)


def upper_edge(bucket: int) -> int:
    """Compute the upper edge of a bucket [ns]."""
    following = bucket + 1
    octave = max((following >> FINE) - 1, 0)
    return (following - (octave << FINE)) << (octave + HISTOGRAM_UNIT)


class Histograms:
    """Rows of histograms in one block of memory, which other processes may read while they are filled.

    Args:
        memory: int64, shape (rows * WIDTH,); zeros before the first time.

    Attributes:
        rows: The same memory, shape (rows, WIDTH); `count_durations` counts there.
    """

    def __init__(self, memory: np.ndarray):
        self.rows = memory.reshape(-1, HISTOGRAM_WORDS)

    def snapshot(self) -> np.ndarray:
        """Copy all counts so far, int64, shape (rows, WIDTH)."""
        return self.rows.copy()

    def since(self, earlier: np.ndarray) -> "Histograms":
        """Return the counts since a snapshot; the longest times are those of the whole run."""
        rows = self.rows - earlier
        rows[:, 1] = self.rows[:, 1]
        return Histograms(rows)

    def count(self, row: int) -> int:
        """Return the number of counted times."""
        return int(self.rows[row, 0])

    def longest(self, row: int) -> int:
        """Return the longest time [ns]; 0 before the first."""
        return int(self.rows[row, 1])

    def quantile(self, row: int, share: float) -> int:
        """Compute a time that at least `share` of all do not exceed [ns]; at most 1/16 too long; 0 without any."""
        sums = np.cumsum(self.rows[row, 2:])
        if not sums[-1]:
            return 0
        bucket = int(np.searchsorted(sums, share * sums[-1]))
        return min(upper_edge(bucket), self.longest(row))
