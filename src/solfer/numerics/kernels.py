"""Compiled look-ups on short vectors: finite, within bounds, gather, scatter. One call where NumPy needs several."""

import numpy as np
from numba import carray

from solfer.numerics.compilation import cached
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


def _tables_finite(first, second):
    """Return whether all values of two tables are finite."""
    total = 0.0
    for table in (first, second):
        for row in table:
            for value in row:
                total += value - value
    return total == 0.0


tables_finite = cached("boolean(float64[:, ::1], float64[:, ::1])", _tables_finite)


def _gather(numbers, rows, source, places, out):
    """Write numbers[rows][:, source] to out[:, places].

    Returns the index, row by row, of the first one that is not finite; -1 if all are.
    """
    wrong, count = -1, len(source)
    for row in range(len(rows)):
        for index in range(count):
            number = numbers[rows[row], source[index]]
            out[row, places[index]] = number
            if number - number != 0.0 and wrong < 0:  # infinity and NaN
                wrong = row * count + index
    return wrong


def _scatter(values, places, dofs, arrays):
    """Write values[row, places] to the entries dofs[places] of the array at the address arrays[row], for each row.

    Returns the rows that this changed, a bit each.
    """
    changed = 0
    for row in range(len(arrays)):
        out = carray(floats(arrays[row]), (1,))
        for index in range(len(places)):
            place = places[index]
            dof, value = dofs[place], values[row, place]
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


gather = cached("int64(float64[:, ::1], int64[::1], int64[::1], int64[::1], float64[:, ::1])", _gather)
scatter = cached("int64(float64[:, ::1], int64[::1], int64[::1], int64[::1])", _scatter)
collect = cached("void(int64[::1], int64[::1], float64[:, ::1])", _collect)
