"""The full dynamics of a robot: M(q) a + h(q, v) = effort."""

from collections.abc import Callable, Hashable
from typing import Protocol

import numpy as np

from solfer.dynamics.update_manager import Calls, UpdateManager
from solfer.model.view import RobotView

BIAS, INERTIA, INERTIA_INVERSE = "bias", "inertia", "inertia_inverse"
"""Names of the elements of a dynamic model."""


class DynamicModel:
    """Bias force, inertia matrix and its inverse, of the Robot's measured state.

    Each is computed at most once for a state: what is subscribed by `update`, the rest at its first use. Arrays are
    live: they hold until the state changes and must not be written to.

    Args:
        robot: The robot.

    Attributes:
        robot: The robot.
        manager: Counts what is wanted and what was computed.
    """

    def __init__(self, robot: RobotView):
        self.robot, self.manager = robot, UpdateManager()
        size = robot.kinematics.size
        self._bias, self._inertia, self._inertia_inverse = np.zeros(size), *np.zeros((2, size, size))
        self.manager.add(BIAS, self._compute_bias, self.stamp(BIAS))
        self.manager.add(INERTIA, self._compute_inertia, self.stamp(INERTIA))
        self.manager.add(INERTIA_INVERSE, self._compute_inverse, self.stamp(INERTIA_INVERSE))

    def subscribe(self, calls: Calls) -> None:
        """See `UpdateManager.subscribe`."""
        self.manager.subscribe(calls)

    def unsubscribe(self, calls: Calls) -> None:
        """See `UpdateManager.unsubscribe`."""
        self.manager.unsubscribe(calls)

    def update(self) -> None:
        """Bring the robot up to date, and compute what is subscribed and stale."""
        self.robot.update()
        self.manager.update()

    def stamp(self, name: str) -> Callable[[], Hashable]:
        """What tells whether the state that an element is computed of has changed."""
        version = self.robot.state.version
        if name == BIAS:
            return lambda: (version("position"), version("velocity"))
        return lambda: version("position")

    @property
    def bias(self) -> np.ndarray:
        """Bias force h: Coriolis, centrifugal and gravity, shape (n,) [Nm, N]."""
        self.manager.use(BIAS)
        return self._bias

    @property
    def inertia(self) -> np.ndarray:
        """Inertia matrix M, both triangles, shape (n, n) [kg, kg m, kg m^2]."""
        self.manager.use(INERTIA)
        return self._inertia

    @property
    def inertia_inverse(self) -> np.ndarray:
        """Inverse of the inertia matrix, both triangles, shape (n, n)."""
        self.manager.use(INERTIA_INVERSE)
        return self._inertia_inverse

    def _compute_bias(self) -> None:
        self._bias = self.robot.kinematics.bias(self.robot.state.position, self.robot.state.velocity)

    def _compute_inertia(self) -> None:
        self._inertia = self.robot.kinematics.inertia(self.robot.state.position)

    def _compute_inverse(self) -> None:
        position = self.robot.state.position
        self._inertia_inverse = self.robot.kinematics.inertia_inverse(position)


class DynamicRobotView(RobotView, Protocol):
    """A Robot with a model of its dynamics that all who work on it share."""

    @property
    def dynamics(self) -> DynamicModel:
        """Dynamics of the measured state."""
