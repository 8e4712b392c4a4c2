"""Compiled look-ups on short vectors: finite, within bounds, gather, scatter. One call where NumPy needs several."""

import math

import numpy as np
from numba import carray

from solfer.numerics.compilation import cached, part
from solfer.numerics.pointers import floats


def all_finite(values: np.ndarray, flags: np.ndarray) -> bool:
    """Return whether all numbers are finite.

    Args:
        values: The numbers.
        flags: Set for each number to whether it is finite; booleans of the same shape.
    """
    return b"\0" not in np.isfinite(values, out=flags).tobytes()


def _inside(values, lower, upper):
    """Return whether each value is finite and within its bounds."""
    for index in range(len(values)):
        value = values[index]
        if not (value - value == 0.0 and lower[index] <= value <= upper[index]):  # false for NaN
            return False
    return True


inside = cached("boolean(float64[::1], float64[::1], float64[::1])", _inside)


def _finite(values):
    """Return whether all values are finite."""
    total = 0.0
    for value in values:
        total += value - value  # NaN for infinity and NaN
    return total == 0.0


finite = cached("boolean(float64[::1])", _finite)


def _take_changes(values, before, kept, is_own):
    """Keep the values that differ from those before, NaN always, and note that they are not one's own any more."""
    for index in range(len(values)):
        if values[index] != before[index]:
            kept[index] = values[index]
            is_own[index] = False


take_changes = cached("void(float64[::1], float64[::1], float64[::1], boolean[::1])", _take_changes)


def _tables_finite(first, second):
    """Return whether all values of two tables are finite."""
    total = 0.0
    for table in (first, second):
        for row in table:
            for value in row:
                total += value - value
    return total == 0.0


tables_finite = cached("boolean(float64[:, ::1], float64[:, ::1])", _tables_finite)


def _scatter(dofs, arrays, values, places):
    """Write values[row, places] to the entries dofs[places] of the array at the address arrays[row], for each row.

    Returns the rows that this changed, a bit each.
    """
    changed = 0
    for row in range(len(arrays)):
        out = carray(floats(arrays[row]), (1,))
        for index in range(len(places)):
            place = places[index]
            dof = dofs[place]
            value = values[row, place]
            if out[dof] != value:
                changed |= 1 << row
            out[dof] = value
    return changed


def _collect(arrays, dofs, out):
    """Write the entries `dofs` of the array at the address arrays[row] to out[row], for each row."""
    for row in range(len(arrays)):
        values = carray(floats(arrays[row]), (1,))
        for index in range(len(dofs)):
            out[row, index] = values[dofs[index]]


@part
def wrapped(displacement, revolution):
    """Return a displacement without whole revolutions; one of 0 is none."""
    return displacement - revolution * math.floor(displacement / revolution + 0.5) if revolution else displacement


def _unwrap(before, revolutions, added, counts, dofs, position, part):
    """Add whole revolutions to positions of senders that count within one, so that none moves by more than half of it.

    Args:
        before: The positions before, NaN: there is none; and the lowest and highest ones that came.
        revolutions: What positions may jump by; 0: nothing.
        added: What is added; written.
        counts: What was added before, at the indices `dofs`; may be `added` itself.
        dofs: See `counts`.
        position: Positions, as they came; written.
        part: Indices of the positions that came.
    """
    for k in range(len(added)):
        added[k] = counts[dofs[k]]
    for k in part:
        if revolutions[k]:
            came = position[k]
            lowest = min(before[1, k], came)
            highest = max(before[2, k], came)
            if before[0, k] == before[0, k] and highest - lowest <= revolutions[k] * (1.0 + 1e-6):
                added[k] = revolutions[k] * math.floor((before[0, k] - came) / revolutions[k] + 0.5)
            position[k] = came + added[k]


unwrap = cached(
    "void(float64[:, ::1], float64[::1], float64[::1], float64[::1], int64[::1], float64[::1], int64[::1])", _unwrap
)


def _keep_revolutions(before, added, dofs, counts, position, part):
    """Keep positions that `unwrap` has written, for the next ones; counts[dofs] has what was added."""
    for k in part:
        came = position[k] - added[k]
        counts[dofs[k]] = added[k]
        before[0, k], before[1, k], before[2, k] = position[k], min(before[1, k], came), max(before[2, k], came)


keep_revolutions = cached(
    "void(float64[:, ::1], float64[::1], int64[::1], float64[::1], float64[::1], int64[::1])", _keep_revolutions
)


def _shorten(displacements, revolutions):
    """Remove whole revolutions from displacements, in place; one of 0 is none.

    Args:
        displacements: Differences of positions, one row at a time.
        revolutions: What positions may jump by, one of each column.
    """
    for row in displacements:
        for k in range(len(revolutions)):
            row[k] = wrapped(row[k], revolutions[k])


shorten = cached("void(float64[:, ::1], float64[::1])", _shorten)


def _keep(block, kept, steps):
    """Copy rows, and return the largest change of a number.

    Args:
        block: Rows of numbers.
        kept: The same before, and afterwards.
        steps: For each row the time that makes a way of its numbers, which are velocities [s]; 0: these are places;
            negative: they do not count.
    """
    displacement = 0.0
    for row in range(len(block)):
        step = steps[row]
        for index in range(len(block[row])):
            number = block[row, index]
            if step >= 0.0:
                displacement = max(displacement, abs(number - kept[row, index]) if step == 0.0 else step * abs(number))
            kept[row, index] = number
    return displacement


scatter = cached("int64(int64[::1], int64[::1], float64[:, ::1], int64[::1])", _scatter)
