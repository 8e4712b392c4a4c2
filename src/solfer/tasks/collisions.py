"""Distances between the robot's own links as constraints."""

import numpy as np

from solfer.errors import TaskError
from solfer.model.collisions.distances import LinkDistances
from solfer.model.view import RobotView
from solfer.tasks.constraints import Constraint, require_positive


class CollisionLimit(Constraint):
    """Links that stay apart.

    For each pair of near shapes with the distance d, the unit vector n from the first to the second and the nearest
    points p and q on them: n' (J_q - J_p) dq >= -max(d - d_min, 0) / T. So a distance falls to d_min within T at the
    earliest, and zero velocity is always allowed. Rows without a near pair are zero. Source: F. Kanehiro, F. Lamiraux,
    O. Kanoun, E. Yoshida, J.-P. Laumond, "A local collision avoidance method for non-strictly convex polyhedra",
    Robotics: Science and Systems 2008.

    Args:
        distances: The distances.
        robot: The Robot.
        nearest: Least distance d_min, not negative [m].
        weight: See `Constraint`.

    Attributes:
        distances: The distances, as of the last `update`.
        nearest: d_min [m]; may be set before each `update`.

    Raises:
        TaskError: The least distance is negative.
    """

    def __init__(self, distances: LinkDistances, robot: RobotView, nearest: float, weight: float | None = None):
        if not 0.0 <= nearest < np.inf:
            raise TaskError(f"a least distance of {nearest:g} m", expected="a number that is not negative")
        count = len(distances.distance)
        kinematics = robot.kinematics
        super().__init__("collisions", np.zeros((count, kinematics.size)), -np.inf, upper=np.inf, weight=weight)
        self.distances = distances
        self._kinematics = kinematics
        self.nearest = nearest
        self._rate = 0.0
        self._carried = kinematics.carried
        self._wrenches = np.zeros((count, 6))
        self._part = np.zeros((count, kinematics.size))

    def set_horizon(self, horizon: float) -> None:
        """Set the time T within which a distance may fall to the least one, not below the period [s].

        Raises:
            TaskError: It is not a positive number.
        """
        self._rate = 1.0 / require_positive(horizon, "a horizon", self.where)

    def update(self) -> None:
        """Compute the rows at the state of the last update of the Robot."""
        near = self.distances
        near.update()
        count = near.count
        self.matrix[:] = 0.0
        self.lower[:] = -np.inf
        self._add(1, 1.0, count)
        self._add(0, -1.0, count)
        if self._kinematics.followers:
            self._kinematics.followers.fold(self.matrix)
        np.subtract(self.nearest, near.distance[:count], out=self.lower[:count])
        np.minimum(self.lower[:count], 0.0, out=self.lower[:count])
        self.lower[:count] *= self._rate

    def _add(self, side: int, sign: float, count: int) -> None:
        """Add n' J of the nearest points of one side; the joints' Jacobian is given at the world's origin."""
        near = self.distances
        wrenches = self._wrenches[:count]
        part = self._part[:count]
        wrenches[:, :3] = near.normal[:count]
        wrenches[:, 3:] = np.cross(near.points[side, :count], near.normal[:count])
        np.dot(wrenches, self._kinematics.tree.jacobian.T, out=part)
        part *= self._carried[near.joints[side, :count]]
        part *= sign
        self.matrix[:count] += part
