"""Whether short vectors are within bounds, compiled: one call where NumPy needs six."""

from solfer.numerics.compilation import cached


def _inside(values, lower, upper):
    """Whether each of the values is finite and none is beyond its bounds."""
    for index in range(len(values)):
        value = values[index]
        if not (value - value == 0.0 and lower[index] <= value <= upper[index]):  # false for NaN
            return False
    return True


inside = cached("boolean(float64[::1], float64[::1], float64[::1])", _inside)
