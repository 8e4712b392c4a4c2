"""Low-pass filters for numbers that arrive once a cycle."""

import math
from functools import partial

import numpy as np

from solfer.errors import ConfigError
from solfer.numerics.compilation import cached


def _filter_values(first, second, factors, started, values):
    """Replace values by filtered ones (direct form II transposed), and note whether the memory holds for the next."""
    for i in range(len(values)):
        if not math.isfinite(values[i]):
            started[0] = False
            return
    b0 = factors[0]
    b1 = factors[1]
    b2 = factors[2]
    a1 = factors[3]
    a2 = factors[4]
    for i in range(len(values)):
        value = values[i]
        if not started[0]:  # as if the input had always been this
            first[i] = value * (1.0 - b0)
            second[i] = value * (b2 - a2)
        filtered = b0 * value + first[i]
        first[i] = b1 * value - a1 * filtered + second[i]
        second[i] = b2 * value - a2 * filtered
        values[i] = filtered
    started[0] = True


_V = "float64[::1]"
filter_values = cached(f"void({_V}, {_V}, {_V}, boolean[::1], float64[:])", _filter_values)


class LowPass:
    """Second-order low-pass filter of several numbers, with unit gain at zero frequency.

    It is w^2 / (s^2 + 2 d w s + w^2) with w = 2 pi f, made discrete by the bilinear transform. The transform bends the
    axis of frequencies; the cut-off f is bent beforehand, so that the gain at f is that of the continuous filter,
    1 / (2 d), for every f below half of the rate. Source: A. V. Oppenheim, R. W. Schafer, "Discrete-Time Signal
    Processing", 3rd ed., section 7.2.2.

    Args:
        size: Number of values n.
        frequency: Cut-off frequency f [Hz].
        damping: Damping ratio d.
        rate: Steps a second [Hz].
        where: Place of the frequency, for the error.

    Attributes:
        factors: Numerator and denominator without its first number, shape (5,); live. Each mean of those of two filters
            makes a stable one with unit gain at zero frequency.
        step: step(values) replaces the newest values, shape (n,), by the filtered ones, and allocates nothing. Values
            that are not finite pass unchanged, and the filter starts again after them.

    Raises:
        ConfigError: The cut-off is not between zero and half of the rate, or the damping is not positive.
    """

    def __init__(self, size: int, frequency: float, damping: float, rate: float, where: str = ""):
        if not 0.0 < frequency < 0.5 * rate:
            raise ConfigError(
                f"a cut-off frequency of {frequency:g} Hz at {rate:g} steps a second",
                where=where,
                expected=f"a frequency above 0 and below half of the rate, {0.5 * rate:g} Hz",
            )
        if not damping > 0.0:
            raise ConfigError(f"a damping ratio of {damping:g}", where=where, expected="a positive number")
        warped = math.tan(math.pi * frequency / rate)
        scale = 1.0 / (1.0 + 2.0 * damping * warped + warped * warped)
        self.numerator = (scale * warped * warped, 2.0 * scale * warped * warped, scale * warped * warped)
        self.denominator = (
            1.0,
            2.0 * scale * (warped * warped - 1.0),
            scale * (1.0 - 2.0 * damping * warped + warped * warped),
        )
        self.factors = np.array((*self.numerator, *self.denominator[1:]))
        self._started = np.zeros(1, dtype=bool)
        self.step = partial(filter_values, *np.zeros((2, size)), self.factors, self._started)

    def reset(self) -> None:
        """Forget everything: the next values pass unchanged, as if the input had always had them."""
        self._started[:] = False
