"""Counts the durations of a cycle. A file of its own, so that readers of histograms need not wait for the compiler."""

from pathlib import Path

import numpy as np

from solfer.numerics.compilation import cached, digest, part
from solfer.realtime.telemetry import histograms

_bucket_of = part(histograms.bucket_of)


def count_durations(rows: np.ndarray, times: np.ndarray, always: int) -> None:
    """Count one duration for each histogram; a zero counts only in the first `always` of them.

    Args:
        rows: `Histograms.rows`, int64, shape (rows, WIDTH).
        times: The durations, int64, shape (rows,) [ns].
        always: Number of histograms that count zeros.
    """
    _count(rows, times, always)


def _compile(sources: str):
    """Compile the kernel; the digest of its sources is in its closure, which is part of the cache's key."""

    def count(rows, times, always):
        """See `count_durations`."""
        sources  # noqa: B018 it has to be used to be in the closure
        for row in range(len(times)):
            time = times[row]
            if row < always or time != 0:
                rows[row, 0] += 1
                rows[row, 1] = max(rows[row, 1], time)
                rows[row, 2 + _bucket_of(time)] += 1

    return cached("void(int64[:, ::1], int64[::1], int64)", count)


_count = _compile(digest((Path(histograms.__file__), Path(__file__))))
