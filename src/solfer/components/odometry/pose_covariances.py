"""Covariances of the base's pose and twist, as they are published."""

import numpy as np

from solfer.components.odometry import filter_kernel
from solfer.components.odometry.filter import FilteredOdometry
from solfer.model.state import POSE_COVARIANCE, TWIST_COVARIANCE, State


class PoseCovariances:
    """Covariances that a filter estimates, in the desired State.

    Args:
        command: The desired State, which gets both as interfaces more.

    Attributes:
        pose: Covariance of position and rotations in world axes, shape (6, 6) [m, rad]; live.
        deviations: Standard deviations of the pose, shape (6,) [m, rad], as of the last `find_deviations`; live.
    """

    def __init__(self, command: State):
        self.pose, self._twist = (command.add(name, 36).reshape(6, 6) for name in (POSE_COVARIANCE, TWIST_COVARIANCE))
        self.deviations = np.zeros(6)
        self._variances = np.einsum("ii->i", self.pose)
        self._heading_twist, self._half = np.zeros((2, 6, 6))
        self._heading_rotation = np.zeros((3, 3))

    def write(self, law: FilteredOdometry, rotation: np.ndarray) -> None:
        """Write the covariances; that of the twist in the axes of the base with a rotation, shape (3, 3)."""
        law.write_covariance(self.pose, self._heading_twist)
        filter_kernel.turn_twist(
            rotation, law.heading, self._heading_twist, self._heading_rotation, self._half, self._twist
        )

    def find_deviations(self) -> None:
        """Compute the standard deviations of the pose."""
        np.sqrt(self._variances, out=self.deviations)
