"""Changes gains slowly: a jump of a loaded spring's stiffness would be a jump of its torque."""

import numpy as np

COMMANDED_DURATION = 0.2
"""Time in which a commanded gain comes into force [s]."""

Joints = np.ndarray | slice
ALL_JOINTS = slice(None)


class GainRamp:
    """Changes an array of gains linearly to other values, each joint in its own time.

    Args:
        gains: The array, written in place, shape (joints,).
    """

    def __init__(self, gains: np.ndarray):
        self._gains, self._goal, self._left = gains, gains.copy(), np.zeros_like(gains)
        self._ratio = np.zeros_like(gains)
        self._change = np.zeros_like(gains)
        self._done = np.zeros(len(gains), dtype=bool)
        self._active = False

    def begin(self, goal: np.ndarray, duration: float, joints: Joints = ALL_JOINTS) -> None:
        """Start a ramp of `joints` to their `goal` that ends in `duration` [s]; at once if that is zero."""
        self._goal[joints] = goal
        self._left[joints] = duration
        self._active = True
        if not duration:
            self._gains[joints] = goal

    def command(self, joints: np.ndarray, goal: np.ndarray) -> None:
        """Start a ramp of the `joints` whose commanded `goal` is a new one; it takes COMMANDED_DURATION."""
        changed = self._goal[joints] != goal
        if changed.any():
            self.begin(goal[changed], COMMANDED_DURATION, joints[changed])

    def stop(self, joints: Joints = ALL_JOINTS) -> None:
        """End the ramp of `joints` where it is."""
        if self._active:
            self._goal[joints] = self._gains[joints]
            self._left[joints] = 0.0

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        if not self._active:
            return
        ratio = self._ratio
        change = self._change
        left = self._left
        ratio.fill(0.0)
        np.divide(dt, left, out=ratio, where=np.greater(left, 0.0, out=self._done))
        np.greater_equal(ratio, 1.0, out=self._done)
        np.subtract(self._goal, self._gains, out=change)
        np.multiply(change, ratio, out=change)
        np.add(self._gains, change, out=self._gains)
        np.copyto(self._gains, self._goal, where=self._done)
        np.subtract(left, dt, out=left)
        np.copyto(left, 0.0, where=self._done)
        np.maximum(left, 0.0, out=left)
        self._active = bool(left.any())
