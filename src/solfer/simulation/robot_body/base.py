"""The base of a robot: where its link is, and how it moves."""

from collections.abc import Sequence

import numpy as np

from solfer.numerics.base_chart import BaseChart
from solfer.simulation.physics import RobotInEngine


class FloatingBase:
    """The base link of a body.

    Args:
        robot: The robot as the engine has loaded it.
        chart: Chart of the base; None: it does not move.

    Attributes:
        position, orientation: Pose of the link's origin in the world, shape (3,) [m] and (4,), (x, y, z, w).
        linear, angular: Velocity of its origin [m/s] and angular velocity [rad/s] in world axes, shape (3,) each.
        floats: Whether it moves.
    """

    def __init__(self, robot: RobotInEngine, chart: BaseChart | None):
        self._robot = robot
        self.floats = chart is not None
        motion = self._motion = np.zeros(13)
        self.orientation, self.position, self.linear, self.angular = np.split(motion, (4, 7, 10))
        self.orientation[3] = 1.0
        if chart is not None:
            # imported here: its compiler takes a while to load
            from solfer.numerics.twist_transport import FROM_POSE, FROM_TWIST, WITH_ORIENTATION, Carried

            at_base = np.concatenate((np.eye(3).ravel(), np.zeros(9)))
            self._in_chart = Carried(chart, motion, at_base)
            self._whole = WITH_ORIENTATION | FROM_POSE | FROM_TWIST

    def place(self, position: Sequence[float] | np.ndarray, orientation: Sequence[float] | np.ndarray) -> None:
        """Put the link's origin somewhere, at rest; no effect if the base does not move."""
        if self.floats:
            self._robot.place_base(position, orientation)

    def read(self, q: np.ndarray, v: np.ndarray) -> None:
        """Read the base, and write its positions and velocities, the first six; no effect if it does not move."""
        if not self.floats:
            return
        self._robot.read_base(self._motion)
        self._in_chart.write(q, v, self._whole)
