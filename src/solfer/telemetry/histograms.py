"""Histograms of durations: rows of fixed memory, which other processes may read while they are filled."""

import numpy as np

RESOLUTION_BITS = 6  # resolution of the shortest times, as a power of two [ns]
OCTAVE_BITS = 4  # buckets in each doubling of the time, as a power of two
BUCKETS = 400
"""Buckets of a histogram: up to 4 s, each at most 1/16 wide; longer times count in the last one."""

ROW_WORDS = BUCKETS + 2
"""Words of a histogram: the number of times, the longest one [ns], then the buckets."""


def bucket_of(nanoseconds: int) -> int:
    """Compute the index of the bucket of a time [ns]."""
    units = max(nanoseconds >> RESOLUTION_BITS, 0)
    octave = 0
    while units >> octave >= 2 << OCTAVE_BITS:
        octave += 1
    return min((octave << OCTAVE_BITS) + (units >> octave), BUCKETS - 1)


def upper_edge(bucket: int) -> int:
    """Compute the upper edge of a bucket [ns]."""
    following = bucket + 1
    octave = max((following >> OCTAVE_BITS) - 1, 0)
    return (following - (octave << OCTAVE_BITS)) << (octave + RESOLUTION_BITS)


def since(histograms: np.ndarray, earlier: np.ndarray) -> np.ndarray:
    """Return the counts of all rows since an earlier copy; the longest times are those of the whole run."""
    recent = histograms - earlier
    recent[:, 1] = histograms[:, 1]
    return recent


def quantile(histogram: np.ndarray, fraction: float) -> int:
    """Compute a time that at least this `fraction` of all do not exceed [ns]; at most 1/16 too long; 0 without any.

    Args:
        histogram: int64, shape (ROW_WORDS,).
        fraction: Of all times.
    """
    sums = np.cumsum(histogram[2:])
    if not sums[-1]:
        return 0
    return min(upper_edge(int(np.searchsorted(sums, fraction * sums[-1]))), int(histogram[1]))
