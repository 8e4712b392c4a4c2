"""Counts the times of a cycle. It is apart from what only looks at histograms, which need not wait for the compiler."""

from pathlib import Path

import numpy as np

from solfer.middleware.xbot import timing
from solfer.numerics.compilation import cached, digest, part

_bucket_of = part(timing.bucket_of)


def tally(rows: np.ndarray, times: np.ndarray, always: int) -> None:
    """Count one time for each histogram [ns]: for the first `always` any time, for the others those that are not zero.

    Args:
        rows: `Histograms.rows`, int64, shape (rows, WIDTH).
        times: int64, shape (rows,).
        always: Number of histograms.
    """
    _count(rows, times, always)


def _compile(sources: str):
    """The kernel; the digest of its sources is in its closure, which is part of the cache's key."""

    def count(rows, times, always):
        """See `tally`."""
        sources  # noqa: B018 it has to be used to be in the closure
        for row in range(len(times)):
            time = times[row]
            if row < always or time != 0:
                rows[row, 0] += 1
                rows[row, 1] = max(rows[row, 1], time)
                rows[row, 2 + _bucket_of(time)] += 1

    return cached("void(int64[:, ::1], int64[::1], int64)", count)


_count = _compile(digest((Path(timing.__file__), Path(__file__))))
