"""Wheels that have reached the end of their steering turn back by half a turn or more."""

import math

import numpy as np

BEYOND, RESTEERING_CYCLES = 0.005, 20
"""How far a command has to be beyond a limit [rad], and for how many cycles in a row, before the wheel turns back."""

RESTEERING_STEP, RESTEERING_MAXIMUM = math.radians(5.0), 2.8
"""How far it turns in each cycle, and altogether at least [rad]."""


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
            if self.sides[index] and abs(state - self._starts[index]) >= RESTEERING_MAXIMUM:
                self.sides[index] = 0.0
            if not self.sides[index]:
                self._watch(index, state, command)
            if self.sides[index]:
                commanded[index] = state + self.sides[index] * RESTEERING_STEP

    def _watch(self, index: int, state: float, command: float) -> None:
        lower = self._lower[index]
        upper = self._upper[index]
        is_low = command < lower - BEYOND and state < lower + BEYOND
        is_high = command > upper + BEYOND and state > upper - BEYOND
        self._counts[index] = self._counts[index] + 1 if is_low or is_high else 0
        if self._counts[index] >= RESTEERING_CYCLES:
            self.sides[index] = 1.0 if is_low else -1.0
            self._starts[index] = state
            self._counts[index] = 0
