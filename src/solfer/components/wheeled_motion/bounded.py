"""Velocities of a stack of tasks within the bounds of the joints."""

import numpy as np

from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.numerics.velocity_bounds import VelocityBounds
from solfer.tasks.stack import Stack

SMALLEST = 1e-9
"""How far a velocity may be beyond its bound [rad/s, m/s]."""


class BoundedDescent:
    """A descent whose joints reach their bounds and no more: what they lack, the other joints do where they can.

    As long as a velocity is beyond its bounds, the one farthest beyond stays at its bound, and the levels are solved
    again by the others. Source: F. Flacco, A. De Luca, O. Khatib, "Control of redundant robots under hard joint
    constraints: saturation in the null space", IEEE Transactions on Robotics 31(3), 2015, without its scaling.

    Args:
        descent: The levels.
        columns: DoFs that move, shape (m,).

    Attributes:
        velocity: Joint velocities as of the last `update`, shape (n,); live.
        count: How many joints were at a bound in the last `update`.
    """

    def __init__(self, descent: DampedDescent, columns: np.ndarray):
        self._descent, self._columns = descent, columns.astype(np.int64)
        self.velocity, self.count = np.zeros_like(descent.velocity), 0
        self._beyond, self._other = np.zeros((2, len(self.velocity)))
        self._is_free = np.ones(len(self.velocity), dtype=bool)

    def update(self, stack: Stack, bounds: VelocityBounds | None) -> np.ndarray:
        """Compute and return the joint velocities; `bounds` are up to date, None where there are none."""
        rates, damping = stack.velocity, stack.numbers[:, 3]
        self.count = 0
        np.copyto(self.velocity, self._descent.update(stack.jacobian, rates, damping))
        if bounds is None:
            return self.velocity
        self._is_free[:] = True
        while (dof := self._farthest(bounds)) is not None:
            value = bounds.upper[dof] if self.velocity[dof] > 0.0 else bounds.lower[dof]
            self._is_free[dof], self._other[dof] = False, value
            rates -= value * stack.jacobian[:, dof]
            self.count += 1
            free = self._columns[self._is_free[self._columns]]
            np.copyto(self.velocity, self._descent.update(stack.jacobian, rates, damping, free))
            np.copyto(self.velocity, self._other, where=~self._is_free)
        return self.velocity

    def _farthest(self, bounds: VelocityBounds) -> int | None:
        """Return the DoF whose velocity is farthest beyond its bounds; None: there is none."""
        np.subtract(self.velocity, bounds.upper, out=self._beyond)
        np.maximum(self._beyond, bounds.lower - self.velocity, out=self._beyond)
        self._beyond[~self._is_free] = 0.0
        dof = int(self._beyond.argmax())
        return dof if self._beyond[dof] > SMALLEST else None
