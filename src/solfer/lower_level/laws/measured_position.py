"""Positions that a robot measures, with the revolutions that its encoders do not count."""

from functools import partial

import numpy as np


class MeasuredPosition:
    """The newest measured position, in which joints without ends have counted their revolutions.

    Args:
        revolutions: Angle after which a joint is where it was, 0 without one, shape (n,) [rad].

    Attributes:
        value: The position, shape (n,) [rad, m]; live.
    """

    def __init__(self, revolutions: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import keep_revolutions, unwrap

        size = len(revolutions)
        self._turning = np.flatnonzero(revolutions)
        self._added = np.zeros(size)
        self._before = np.zeros((3, size))  # see the kernel
        known = self._added, np.arange(size)
        self._unwrap = partial(unwrap, self._before, revolutions, self._added, *known)
        self._keep_revolutions = partial(keep_revolutions, self._before, self._added, np.arange(size), np.zeros(size))
        self.value = np.zeros(size)

    def start(self, q: np.ndarray) -> None:
        """Begin at a position."""
        self.value[:] = q
        self._before[:] = q
        self._added[:] = 0.0

    def measure(self, q: np.ndarray) -> np.ndarray:
        """Take over a measured position; return it with its revolutions: encoders may count within one."""
        value = self.value
        value[:] = q
        if not self._turning.size:
            return q
        self._unwrap(value, self._turning)
        self._keep_revolutions(value, self._turning)
        return value
