"""What `odometry` publishes and offers besides its pipes."""

from dataclasses import dataclass, field

import numpy as np

from solfer.components.geometry import Header, Pose, Turn, Vector

ZEROS = (0.0,) * 36


@dataclass(frozen=True)
class SetBase:
    """Where the base is on the ground.

    Attributes:
        x: Position [m].
        y: Position [m].
        yaw: Direction in which the robot looks [rad].
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


@dataclass(frozen=True)
class UncertainPose:
    """A pose, and the covariance of x, y, z [m] and of turns about the axes of the world [rad], row by row."""

    pose: Pose = field(default_factory=Pose)
    covariance: tuple[float, ...] = ZEROS


@dataclass(frozen=True)
class StampedUncertainPose:
    """A `geometry_msgs/PoseWithCovarianceStamped`."""

    header: Header = field(default_factory=Header)
    pose: UncertainPose = field(default_factory=UncertainPose)


def stamped_pose(frame: str, position: np.ndarray, quaternion: np.ndarray, covariance: np.ndarray) -> object:
    """Make a message: position, shape (3,) [m], quaternion (x, y, z, w), and their covariance, shape (6, 6)."""
    pose = Pose(Vector(*position.tolist()), Turn(*quaternion.tolist()))
    return StampedUncertainPose(Header(frame_id=frame), UncertainPose(pose, tuple(covariance.ravel().tolist())))
