"""Short vectors by their places, compiled: one call where NumPy needs several."""

from solfer.numerics.compilation import cached


def _gather(numbers, places, out):
    """Write numbers[places] to `out`; the first place of `out` that is not finite, -1 if all are."""
    wrong = -1
    for index in range(len(places)):
        number = numbers[places[index]]
        out[index] = number
        if number - number != 0.0 and wrong < 0:  # infinity and NaN
            wrong = index
    return wrong


def _scatter(values, places, out):
    """Write `values` to out[places]; whether that changed anything."""
    changed = False
    for index in range(len(places)):
        place, value = places[index], values[index]
        if out[place] != value:
            changed = True
        out[place] = value
    return changed


gather = cached("int64(float64[::1], int64[::1], float64[::1])", _gather)
scatter = cached("boolean(float64[::1], int64[::1], float64[::1])", _scatter)
