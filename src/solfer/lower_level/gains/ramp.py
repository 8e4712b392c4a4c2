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

    Attributes:
        block: The numbers of the compiled step.
    """

    def __init__(self, gains: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.lower_level.laws.controllers_kernel import RAMP
        from solfer.numerics.blocks import MemoryBlock

        self._gains, self._goal, self._left = gains, gains.copy(), np.zeros_like(gains)
        self.block = MemoryBlock(RAMP, count=len(gains), gains=gains, goal=self._goal, left=self._left)

    def begin(self, goal: np.ndarray, duration: float, joints: Joints = ALL_JOINTS) -> None:
        """Start a ramp of `joints` to their `goal` that ends in `duration` [s]; at once if that is zero."""
        self._goal[joints] = goal
        self._left[joints] = duration
        if not duration:
            self._gains[joints] = goal

    def command(self, joints: np.ndarray, goal: np.ndarray) -> None:
        """Start a ramp of the `joints` whose commanded `goal` is a new one; it takes COMMANDED_DURATION."""
        changed = self._goal[joints] != goal
        if changed.any():
            self.begin(goal[changed], COMMANDED_DURATION, joints[changed])

    def stop(self, joints: Joints = ALL_JOINTS) -> None:
        """End the ramp of `joints` where it is."""
        self._left[joints] = 0.0
