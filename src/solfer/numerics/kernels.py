"""Compiled look-ups on short vectors: finite, within bounds, gather, scatter. One call where NumPy needs several."""

import numpy as np

from solfer.numerics.compilation import cached


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


def _gather(numbers, places, out):
    """Write numbers[places] to `out`; return the first place of `out` that is not finite, -1 if all are."""
    wrong = -1
    for index in range(len(places)):
        number = numbers[places[index]]
        out[index] = number
        if number - number != 0.0 and wrong < 0:  # infinity and NaN
            wrong = index
    return wrong


def _scatter(values, places, out):
    """Write `values` to out[places]; return whether that changed anything."""
    changed = False
    for index in range(len(places)):
        place, value = places[index], values[index]
        if out[place] != value:
            changed = True
        out[place] = value
    return changed


gather = cached("int64(float64[::1], int64[::1], float64[::1])", _gather)
scatter = cached("boolean(float64[::1], int64[::1], float64[::1])", _scatter)
