"""Compiled steps of samples that are sorted by their stamps, see `SortedSamples` and `ImuSamples`."""

import math

from solfer.numerics.compilation import cached, part

LONGEST_LAG = 0.03
"""Longest time for which joints wait for what the IMU measures at their time [s]."""


def _insert(stamps, rows, count, stamp):
    """Make room for a sample among `count` others, the oldest of which goes where there is none; return its row.

    It is -1, and nothing changes, where there is one with that stamp, or all are newer and there is no room.
    """
    row = count
    while row and stamps[row - 1] > stamp:
        row -= 1
    is_full = count == len(stamps)
    if (row == 0 and is_full) or (row and stamps[row - 1] == stamp):
        return -1
    if is_full:
        row -= 1
        for k in range(row):
            stamps[k] = stamps[k + 1]
            rows[k] = rows[k + 1]
    else:
        for k in range(count, row, -1):
            stamps[k] = stamps[k - 1]
            rows[k] = rows[k - 1]
    stamps[row] = stamp
    return row


def _copy(values, first, second, places, out):
    """Copy two rows of values to the places of each half of `out`; what is NaN is not there."""
    half = len(out) // 2
    for k in range(len(places)):
        value = values[first, k]
        if value == value:
            out[places[k]] = value
        value = values[second, k]
        if value == value:
            out[half + places[k]] = value


@part
def turned_at(stamps, rows, before, after, fraction, out):
    """Write the integral of the rates at a fraction of the time from one sample to the next, shape (3,) [rad].

    A sample has three angles, their rates, and the integrals of these.
    """
    span = stamps[after] - stamps[before]
    for k in range(3):
        if span > LONGEST_LAG:  # too long for rates: angles do not drift in it
            change = rows[after, k] - rows[before, k]
            displacement = fraction * (change - math.tau * round(change / math.tau))
        else:
            rate = rows[before, 3 + k]
            displacement = fraction * span * (rate + 0.5 * fraction * (rows[after, 3 + k] - rate))
        out[k] = rows[before, 6 + k] + displacement


def _turned_at(stamps, rows, before, after, fraction, out):
    """See `turned_at`."""
    turned_at(stamps, rows, before, after, fraction, out)


def _integrate(stamps, rows, first, count):
    """Integrate the rates up to each sample from the row `first` on."""
    for later in range(max(first, 1), count):
        turned_at(stamps, rows, later - 1, later, 1.0, rows[later, 6:9])


_V = "float64[::1]"
_M = "float64[:, ::1]"
insert = cached(f"int64({_V}, {_M}, int64, float64)", _insert)
copy = cached(f"void({_M}, int64, int64, int64[::1], {_V})", _copy)
find_turned = cached(f"void({_V}, {_M}, int64, int64, float64, {_V})", _turned_at)
integrate = cached(f"void({_V}, {_M}, int64, int64)", _integrate)
