"""Low-pass filters for numbers that arrive once a cycle."""

import math

import numpy as np

from solfer.errors import ConfigError


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
        self._started = False
        self._input, self._product, self._finite = np.zeros(size), np.zeros(size), np.zeros(size, dtype=bool)
        self._first, self._second = np.zeros(size), np.zeros(size)

    def reset(self) -> None:
        """Forget everything: the next values pass unchanged, as if the input had always had them."""
        self._started = False

    def step(self, values: np.ndarray) -> None:
        """Replace the newest values, shape (n,), by the filtered ones. Allocates nothing.

        Values that are not finite pass unchanged, and the filter starts anew after them.
        """
        if not np.isfinite(values, out=self._finite).all():
            self._started = False
            return
        if not self._started:
            self._start(values)
        np.copyto(self._input, values)
        self._add(self.numerator[0], self._input, self._first, out=values)
        self._add(self.numerator[1], self._input, self._second, out=self._first)
        self._add(-self.denominator[1], values, self._first, out=self._first)
        np.multiply(self._input, self.numerator[2], out=self._second)
        self._add(-self.denominator[2], values, self._second, out=self._second)

    def _start(self, values: np.ndarray) -> None:
        """Set the memory of a filter whose input and output have always been `values`."""
        np.multiply(values, 1.0 - self.numerator[0], out=self._first)
        np.multiply(values, self.numerator[2] - self.denominator[2], out=self._second)
        self._started = True

    def _add(self, factor: float, values: np.ndarray, other: np.ndarray, out: np.ndarray) -> None:
        """Write factor values + other into `out`."""
        np.multiply(values, factor, out=self._product)
        np.add(self._product, other, out=out)
