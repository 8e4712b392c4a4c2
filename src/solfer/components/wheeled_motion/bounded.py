"""Velocities of a stack of tasks within the bounds of the joints."""

import numpy as np

from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.numerics.velocity_bounds import VelocityBounds
from solfer.tasks.stack import Stack

SMALLEST = 1e-9
"""How far a velocity may be beyond its bound [rad/s, m/s]."""

SLIDING = 1e-3
"""Speed with which material at a contact may move because joints are at their bounds [m/s]."""


class BoundedDescent:
    """A descent whose joints reach their bounds and no more: what they lack, the other joints do where they can.

    As long as a velocity is beyond its bounds, the one farthest beyond stays at its bound, and the levels are solved
    again by the others. Source: F. Flacco, A. De Luca, O. Khatib, "Control of redundant robots under hard joint
    constraints: saturation in the null space", IEEE Transactions on Robotics 31(3), 2015. Where that would break the
    first rows, such as those of contacts that do not slide, all joints keep the velocities without bounds, multiplied
    by the largest share that is within the bounds.

    Args:
        descent: The levels.
        columns: DoFs that move, shape (m,).
        rigid: How many of the first rows are never given up; their rates are zero.

    Attributes:
        velocity: Joint velocities as of the last `update`, shape (n,); live.
        count: How many joints were at a bound in the last `update`.
        last: The DoF that reached its bound last; -1 if none did.
    """

    def __init__(self, descent: DampedDescent, columns: np.ndarray, rigid: int = 0):
        self._descent, self._columns, self._rigid = descent, columns.astype(np.int64), rigid
        self.velocity, self.count, self.last = np.zeros_like(descent.velocity), 0, -1
        self._free, self._sliding = np.zeros_like(descent.velocity), np.zeros(rigid)
        self._beyond, self._other = np.zeros((2, len(self.velocity)))
        self._is_free = np.ones(len(self.velocity), dtype=bool)

    def update(self, stack: Stack, bounds: VelocityBounds | None) -> np.ndarray:
        """Compute and return the joint velocities; `bounds` are up to date, None where there are none."""
        rates, damping = stack.velocity, stack.numbers[:, 3]
        self.count, self.last = 0, -1
        np.copyto(self.velocity, self._descent.update(stack.jacobian, rates, damping))
        if bounds is None:
            return self.velocity
        self._is_free[:] = True
        np.copyto(self._free, self.velocity)
        while (dof := self._farthest(bounds)) is not None:
            value = bounds.upper[dof] if self.velocity[dof] > 0.0 else bounds.lower[dof]
            self._is_free[dof], self._other[dof] = False, value
            rates -= value * stack.jacobian[:, dof]
            self.count, self.last = self.count + 1, dof
            free = self._columns[self._is_free[self._columns]]
            np.copyto(self.velocity, self._descent.update(stack.jacobian, rates, damping, free))
            np.copyto(self.velocity, self._other, where=~self._is_free)
            if self._rigid and self._slides(stack):
                self._shorten(bounds)
                break
        return self.velocity

    def _slides(self, stack: Stack) -> bool:
        """Whether the velocities break the first rows."""
        np.dot(stack.jacobian[: self._rigid], self.velocity, out=self._sliding)
        return max(float(self._sliding.max()), -float(self._sliding.min())) > SLIDING

    def _shorten(self, bounds: VelocityBounds) -> None:
        """Write the velocities without bounds, multiplied by the largest share that is within the bounds."""
        share = 1.0
        for dof in self._columns.tolist():
            value = float(self._free[dof])
            bound = float(bounds.upper[dof] if value > 0.0 else bounds.lower[dof])
            if abs(value) * share > abs(bound):
                share, self.last = abs(bound / value), dof
        np.multiply(self._free, share, out=self.velocity)

    def _farthest(self, bounds: VelocityBounds) -> int | None:
        """Return the DoF whose velocity is farthest beyond its bounds; None: there is none."""
        np.subtract(self.velocity, bounds.upper, out=self._beyond)
        np.maximum(self._beyond, bounds.lower - self.velocity, out=self._beyond)
        self._beyond[~self._is_free] = 0.0
        dof = int(self._beyond.argmax())
        return dof if self._beyond[dof] > SMALLEST else None
