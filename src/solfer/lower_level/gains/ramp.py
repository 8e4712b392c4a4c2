"""Changes gains slowly: a jump of a loaded spring's stiffness would be a jump of its torque."""

import numpy as np


class GainRamp:
    """Changes an array of gains linearly to other values.

    Args:
        gains: The array, written in place, shape (joints,).
    """

    def __init__(self, gains: np.ndarray):
        self._gains, self._goal, self._left = gains, gains.copy(), 0.0
        self._change = np.zeros_like(gains)

    def begin(self, goal: np.ndarray, duration: float) -> None:
        """Start a ramp to `goal`, shape (joints,), that ends in `duration` [s]; at once if that is zero."""
        self._goal[:], self._left = goal, duration
        if not duration:
            self._gains[:] = goal

    def leave(self, indices: np.ndarray) -> None:
        """Exclude the gains at `indices` from the ramp: they were commanded, and stay as they are."""
        self._goal[indices] = self._gains[indices]

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        if self._left <= 0.0:
            return
        np.subtract(self._goal, self._gains, out=self._change)
        np.multiply(self._change, min(dt / self._left, 1.0), out=self._change)
        np.add(self._gains, self._change, out=self._gains)
        self._left -= dt
