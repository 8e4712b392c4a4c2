"""The full dynamics of a robot: M(q) a + h(q, v) = effort."""

from collections.abc import Callable, Hashable
from functools import partial
from operator import itemgetter
from typing import Protocol

from solfer.dynamics.elements import BIAS, INERTIA, Elements
from solfer.dynamics.kernel import PLACE, WITH_BIAS, WITH_INERTIA
from solfer.dynamics.recursion import Recursion
from solfer.model.view import RobotView


class DynamicModel(Elements):
    """The Robot's measured state: bias force h, shape (n,), inertia matrix M and its inverse, shape (n, n) each.

    Args:
        robot: The robot.

    Attributes:
        robot: The robot.
    """

    def __init__(self, robot: RobotView):
        self.robot = robot
        self._recursion = Recursion(robot)
        self._placed = -1
        self._bias = self._recursion.bias
        self._inertia = self._recursion.inertia
        self._inertia_inverse = self._recursion.inertia_inverse
        super().__init__(
            self.stamp, partial(self._compute, WITH_BIAS), partial(self._compute, WITH_INERTIA), self._compute_inverse
        )

    def update(self) -> None:
        """Bring the robot up to date, and compute what is subscribed and stale."""
        self.robot.update()
        self.manager.update()

    def stamp(self, name: str) -> Callable[[], Hashable]:
        """Return a function whose result changes with the state that an element is computed of."""
        inputs = ("position", "velocity") if name == BIAS else ("position",)
        return partial(itemgetter(*inputs), self.robot.state.versions)

    def _compute(self, parts: int) -> None:
        """Compute bias force or inertia; the bodies move to their places in the state once for all elements."""
        self.robot.update()
        version = self.robot.state.versions["position"]
        self._recursion.compute(parts if version == self._placed else parts | PLACE)
        self._placed = version

    def _compute_inverse(self) -> None:
        self.manager.refresh(INERTIA)
        self._recursion.compute_inverse()


class DynamicRobotView(RobotView, Protocol):
    """A Robot with a model of its dynamics, which all its users have in common."""

    @property
    def dynamics(self) -> DynamicModel:
        """Dynamics of the measured state."""
