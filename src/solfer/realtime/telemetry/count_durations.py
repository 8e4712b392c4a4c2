"""Counts the durations of a cycle. A file of its own, so that readers of histograms need not wait for the compiler."""

from pathlib import Path

import numpy as np

from solfer.numerics.compilation import cached, part
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


def count(rows, times, always):
    """See `count_durations`."""
    for row in range(len(times)):
        time = times[row]
        if row < always or time != 0:
            rows[row, 0] += 1
            rows[row, 1] = max(rows[row, 1], time)
            rows[row, 2 + _bucket_of(time)] += 1


_count = cached("void(int64[:, ::1], int64[::1], int64)", count, sources=[Path(histograms.__file__)])
