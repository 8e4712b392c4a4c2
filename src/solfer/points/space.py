"""Spaces of the values of points: their numbers, the rows of their Jacobians, and their differences."""

from dataclasses import dataclass

import numpy as np

from solfer.points.compiled.algebra import minus, orientation_minus, pose_minus
from solfer.points.compiled.kernel import difference
from solfer.points.compiled.registry import Kernel

__all__ = ["ORIENTATION", "POSE", "vector"]


@dataclass(frozen=True)
class Space:
    """A space of values.

    Attributes:
        name: Name of its values.
        size: Numbers of a value.
        rows: Degrees of freedom: numbers of a difference, rows of a Jacobian.
        minus: Operation of the kernel that subtracts two values.
    """

    name: str
    size: int
    rows: int
    minus: Kernel

    @property
    def is_vector(self) -> bool:
        """Whether values can be added."""
        return self.minus is minus

    def neutral(self) -> np.ndarray:
        """Return zero, no rotation, or both, shape (size,)."""
        value = np.zeros(self.size)
        if not self.is_vector:
            value[-1] = 1.0
        return value

    def subtract(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Subtract b from a, shape (rows,).

        It is a plain difference; for orientations the rotation vector in world axes that turns b into a [rad]; for
        poses both.
        """
        if self.is_vector:
            return a - b
        out = np.empty(self.rows)
        angular = slice(self.size - 4, None)
        difference(a[angular], b[angular], out[self.rows - 3 :])
        out[: self.rows - 3] = a[: self.size - 4] - b[: self.size - 4]
        return out

    def __str__(self) -> str:
        rows = "" if self.rows == self.size else f", {self.rows} rows"
        return f"{self.name} ({self.size} numbers{rows})"


def vector(size: int) -> Space:
    """Return the space of `size` numbers that are added one by one."""
    return Space("vector", size, size, minus=minus)


ORIENTATION = Space("orientation", 4, 3, minus=orientation_minus)
"""Unit quaternions (x, y, z, w); Jacobians map to angular velocities in world axes."""

POSE = Space("pose", 7, 6, minus=pose_minus)
"""Positions [m], then unit quaternions (x, y, z, w); Jacobians map to linear, then angular velocities."""
