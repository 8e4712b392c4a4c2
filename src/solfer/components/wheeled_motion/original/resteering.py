"""Wheels that have reached the end of their steering turn back by nearly half a revolution."""

import math

import numpy as np

STEP_ANGLE = math.radians(5.0)
"""How far a wheel turns back in each cycle [rad]."""


class Resteering:
    """Turns the joint of a wheel's steering back from its limit, as the original program does.

    Args:
        lower: Lower limits of the joints, shape (m,) [rad].
        upper: Upper limits, shape (m,) [rad].

    Attributes:
        sides: 0 for a joint that steers, 1 or -1 for one that turns back to larger or smaller angles, shape (m,).
    """

    def __init__(self, lower: np.ndarray, upper: np.ndarray):
        self._lower, self._upper, count = lower.copy(), upper.copy(), len(lower)
        self.sides = np.zeros(count)
        self._counts = [0] * count
        self._starts = [0.0] * count

    def start(self) -> None:
        """Let all joints steer."""
        self.sides[:], self._counts = 0.0, [0] * len(self._counts)

    def update(self, measured: np.ndarray, commanded: np.ndarray) -> None:
        """Write what joints are to do that turn back; both have shape (m,) [rad]."""
        for index, (state, command) in enumerate(zip(measured.tolist(), commanded.tolist(), strict=True)):
            if self.sides[index] and abs(state - self._starts[index]) >= 2.8:  # [rad] altogether
                self.sides[index] = 0.0
            if not self.sides[index]:
                self._watch(index, state, command)
            if self.sides[index]:
                commanded[index] = state + self.sides[index] * STEP_ANGLE

    def _watch(self, index: int, state: float, command: float) -> None:
        lower = self._lower[index]
        upper = self._upper[index]
        tolerance = 0.005  # [rad] by which a command has to be beyond the limit
        is_low = command < lower - tolerance and state < lower + tolerance
        is_high = command > upper + tolerance and state > upper - tolerance
        self._counts[index] = self._counts[index] + 1 if is_low or is_high else 0
        if self._counts[index] >= 20:  # cycles in a row
            self.sides[index] = 1.0 if is_low else -1.0
            self._starts[index] = state
            self._counts[index] = 0
