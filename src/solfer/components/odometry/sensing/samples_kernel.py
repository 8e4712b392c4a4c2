"""Compiled steps of samples that are sorted by their stamps, see `SortedSamples` and `ImuSamples`."""

import math
from pathlib import Path

from solfer.numerics import base_chart
from solfer.numerics.compilation import cached, exact_part, part

_rotation_of = part(base_chart.rotation_of)

LONGEST_LAG = 0.03
"""Longest time for which joints wait for what the IMU measures at their time [s]."""


@part
def make_room(stamps, rows, count, stamp):
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


@part
def copy_message(values, which, places, out):
    """Copy two rows of values, one after the other, to the places of each; what is NaN is not there."""
    size = len(places)
    for half in range(len(which)):
        for k in range(size):
            value = values[which[half], k]
            if value == value:
                out[half * size + places[k]] = value


@part
def turned_at(stamps, rows, before, after, fraction, out):
    """Write the integrals of rates and acceleration at a fraction of the time from one sample to the next, shape (6,).

    A sample has three angles, their rates, the acceleration in the world, and the integrals of both [rad, m/s]. That of
    the acceleration is NaN where the time is too long for it.
    """
    span = stamps[after] - stamps[before]
    for k in range(3):
        slope = rows[after, 6 + k] - rows[before, 6 + k]
        change = fraction * span * (rows[before, 6 + k] + 0.5 * fraction * slope)
        out[3 + k] = math.nan if span > LONGEST_LAG else rows[before, 12 + k] + change
        if span > LONGEST_LAG:  # too long for rates: angles do not drift in it
            change = rows[after, k] - rows[before, k]
            displacement = fraction * (change - math.tau * round(change / math.tau))
        else:
            rate = rows[before, 3 + k]
            displacement = fraction * span * (rate + 0.5 * fraction * (rows[after, 3 + k] - rate))
        out[k] = rows[before, 9 + k] + displacement


@exact_part
def _integrate(stamps, rows, first, count, force, origin):
    """Write the acceleration of the sample `first`, and integrate it and the rates up to each sample from there on.

    Args:
        stamps: Stamps of the samples [s].
        rows: The samples, see `turned_at`.
        first: Row of the first one.
        count: Number of all.
        force: Its specific force in the axes of the base [m/s^2]; zeros: it is not measured.
        origin: Rotation from the axes of the base's chart to the world.
    """
    gravity = 9.81
    row = rows[first]
    turned = _rotation_of(row[0], row[1], row[2])
    for i in range(3):
        row[6 + i] = 0.0
        for k in range(3):
            row[6 + i] += origin[i, k] * (
                turned[3 * k] * force[0] + turned[3 * k + 1] * force[1] + turned[3 * k + 2] * force[2]
            )
    row[8] -= gravity
    if force[0] == 0.0 and force[1] == 0.0 and force[2] == 0.0:
        row[6:9] = math.nan
    for later in range(max(first, 1), count):
        turned_at(stamps, rows, later - 1, later, 1.0, rows[later, 9:15])
        if rows[later, 12] != rows[later, 12] and rows[later, 6] == rows[later, 6]:
            rows[later, 12:15] = 0.0  # integrate again from here: the accelerometer is back


def _insert(stamps, rows, count, stamp, known, values, which, places, force, origin):
    """Insert a sample, see `make_room` and `copy_message`; it begins with what is `known`. Returns its row, or -1.

    One of an IMU has a specific `force`; it is integrated then.
    """
    row = make_room(stamps, rows, count, stamp)
    if row >= 0:
        rows[row, : len(known)] = known
        copy_message(values, which, places, rows[row])
        if len(force):
            _integrate(stamps, rows, row, min(count + 1, len(stamps)), force, origin)
    return row


def _copy(values, which, places, out):
    """See `copy_message`."""
    copy_message(values, which, places, out)


def _turned_at(stamps, rows, before, after, fraction, out):
    """See `turned_at`."""
    turned_at(stamps, rows, before, after, fraction, out)


_V = "float64[::1]"
_M = "float64[:, ::1]"
_I = "int64[::1]"
insert = cached(
    f"int64({_V}, {_M}, int64, float64, {_V}, {_M}, {_I}, {_I}, {_V}, {_M})",
    _insert,
    sources=[Path(base_chart.__file__)],
)
copy = cached(f"void({_M}, {_I}, {_I}, {_V})", _copy)
find_turned = cached(f"void({_V}, {_M}, int64, int64, float64, {_V})", _turned_at)
