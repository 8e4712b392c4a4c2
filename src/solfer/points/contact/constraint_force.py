"""Forces of constraints as Dynamic Points: A x + b with x the efforts of the DoFs."""

import weakref
from collections.abc import Iterable
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from solfer.dynamics import BIAS, INERTIA_INVERSE
from solfer.dynamics.dynamic_model import DynamicRobotView
from solfer.errors import PointError
from solfer.numerics.solvers.pseudo_inverse import SymmetricPseudoInverse
from solfer.points.acceleration import (
    Acceleration,
    AngularAcceleration,
    LinearAcceleration,
    SpatialAcceleration,
)
from solfer.points.dynamic import DynamicPoint
from solfer.points.handler import Handler
from solfer.points.offset import finite
from solfer.points.space import vector

__all__ = ["ConstraintForce", "Force", "Torque", "Wrench"]

DYNAMICS_CALLS = {BIAS: 2, INERTIA_INVERSE: 1}
"""Elements of the dynamics that one update uses, with the number of calls."""


class ConstraintForce(DynamicPoint):
    """Forces of the world on the robot that give several accelerations their demanded values, world axes [N, Nm].

    A x + b with x the efforts of the DoFs, `robot.state.torque`. With the Jacobian J of the accelerations, their offset
    dJ/dt v, their demanded values a (zero for what holds or rolls), the dynamics M qdd + h = x + J^T f and
    L = (J M^-1 J^T)^+: f = L (J M^-1 (h - x) - dJ/dt v + a), so A = -L J M^-1 and b = L (J M^-1 h - dJ/dt v + a).
    Where constraints depend on each other, these are the smallest of all forces that do it. Source: O. Khatib, "A
    unified approach for motion and force control of robot manipulators", IEEE Journal of Robotics and Automation 3(1),
    1987.

    Forces act on each other: contacts that hold at the same time belong into one ConstraintForce. `update` updates the
    accelerations, too, and the stale elements of `robot.dynamics`.

    Args:
        accelerations: Constrained accelerations; forces have their order.
        size: Numbers of the value, where a subclass turns forces along the accelerations into others; None: the rows
            of the accelerations.

    Attributes:
        accelerations: Handler of the constrained accelerations.

    Raises:
        PointError: There is no acceleration, or they are of different Robots.
    """

    def __init__(self, accelerations: Iterable[Acceleration], size: int | None = None):
        self.accelerations = Handler(accelerations)
        for acceleration in self.accelerations:
            if not isinstance(acceleration, Acceleration):
                raise PointError(f"no force constrains {acceleration}", expected="accelerations")
        if not len(self.accelerations):
            raise PointError("forces of no constraint", expected="at least one acceleration")
        robot = cast(DynamicRobotView, self.accelerations[0].robot)
        rows = self.accelerations.rows
        cols = self.accelerations.cols
        super().__init__(vector(rows if size is None else size), robot)
        self._dynamics = robot.dynamics
        self._dynamics.subscribe(DYNAMICS_CALLS)
        weakref.finalize(self, self._dynamics.unsubscribe, DYNAMICS_CALLS).atexit = False
        self._demanded, self._held, self._needed = np.zeros((3, rows))
        self._effort = np.zeros(cols)
        self._response, self._inertia = np.zeros((rows, cols)), SymmetricPseudoInverse(rows)

    @property
    def x(self) -> np.ndarray:
        """Efforts of the DoFs, `robot.state.torque`, shape (n,) [Nm, N]; live."""
        return self.robot.state.torque

    def demand(self, acceleration: ArrayLike) -> None:
        """Set the values of the accelerations from the next update on, shape (accelerations.rows,) [m/s^2, rad/s^2].

        Raises:
            SizeMismatch, NotFinite: These are not that many finite numbers.
        """
        self._demanded[:] = finite(acceleration, len(self._demanded), f"accelerations demanded of {self}")

    def update(self, jacobian: bool = True) -> None:
        """Compute the Jacobian if `jacobian`, the offset and the value, at the last update of the Robot."""
        self.accelerations.update()
        constraints = self.accelerations.jacobian
        np.dot(constraints, self._dynamics.inertia_inverse, out=self._response)
        np.dot(self._response, constraints.T, out=self._inertia.matrix)
        self._inertia.update()
        self._mass = self._spread_forces()
        super().update(jacobian)

    def compute_jacobian(self) -> None:
        """Write the Jacobian."""
        np.dot(self._mass, self._response, out=self._jacobian)
        np.negative(self._jacobian, out=self._jacobian)

    def compute_offset(self) -> None:
        """Write the offset."""
        np.subtract(self._demanded, self.accelerations.offset, out=self._held)
        self._hold(self._dynamics.bias, self.offset)

    def compute(self) -> None:
        """Write the value; it does not need the Jacobian."""
        np.subtract(self._dynamics.bias, self.x, out=self._effort)
        self._hold(self._effort, self._value)

    def _hold(self, effort: np.ndarray, out: np.ndarray) -> None:
        """Write the forces that balance an effort, shape (n,)."""
        np.dot(self._response, effort, out=self._needed)
        self._needed += self._held
        np.dot(self._mass, self._needed, out=out)

    def _spread_forces(self) -> np.ndarray:
        """Return the map from needed accelerations to the value, shape (size, rows); here it is L."""
        return self._inertia.value


class Force(ConstraintForce):
    """Force of the world on the robot that holds a point of a link, world axes [N].

    A x + b with x the efforts of the DoFs, `robot.state.torque`; A, b: `ConstraintForce`.

    Args:
        link: Name of the link.
        robot: The Robot.
        offset: The point in the frame of the link, shape (3,) [m].

    Attributes:
        acceleration: The constrained acceleration; its `set_fixed`, `set_world` and `set_reference` move the point.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: The offset is not three finite numbers.
    """

    def __init__(self, link: str, robot: DynamicRobotView, offset: ArrayLike = (0.0, 0.0, 0.0)):
        self.acceleration = LinearAcceleration(link, robot, offset)
        super().__init__([self.acceleration])


class Torque(ConstraintForce):
    """Torque of the world on the robot that keeps a link from turning, world axes [Nm].

    A x + b with x the efforts of the DoFs, `robot.state.torque`; A, b: `ConstraintForce`.

    Args:
        link: Name of the link.
        robot: The Robot.

    Attributes:
        acceleration: The constrained acceleration.

    Raises:
        UnknownName: The robot has no such link.
    """

    def __init__(self, link: str, robot: DynamicRobotView):
        self.acceleration = AngularAcceleration(link, robot)
        super().__init__([self.acceleration])


class Wrench(ConstraintForce):
    """Force, then torque about a point of a link, of the world on the robot that hold the link, world axes [N, Nm].

    A x + b with x the efforts of the DoFs, `robot.state.torque`; A, b: `ConstraintForce`. Arguments, attributes and
    errors: `Force`.
    """

    def __init__(self, link: str, robot: DynamicRobotView, offset: ArrayLike = (0.0, 0.0, 0.0)):
        self.acceleration = SpatialAcceleration(link, robot, offset)
        super().__init__([self.acceleration])
