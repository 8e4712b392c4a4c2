"""What `odometry` publishes and offers besides its pipes."""

from dataclasses import dataclass, field

import numpy as np

from solfer.interfaces.geometry import Header, Pose, Turn, Vector


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
    """A pose, and the covariance of x, y, z [m] and of rotations about the axes of the world [rad], row by row."""

    pose: Pose = field(default_factory=Pose)
    covariance: tuple[float, ...] = (0.0,) * 36


@dataclass(frozen=True)
class StampedUncertainPose:
    """A `geometry_msgs/PoseWithCovarianceStamped`."""

    header: Header = field(default_factory=Header)
    pose: UncertainPose = field(default_factory=UncertainPose)


def stamped_pose(frame: str, position: np.ndarray, quaternion: np.ndarray, covariance: np.ndarray) -> object:
    """Make a message: position, shape (3,) [m], quaternion (x, y, z, w), and their covariance, shape (6, 6)."""
    pose = Pose(Vector(*position.tolist()), Turn(*quaternion.tolist()))
    return StampedUncertainPose(Header(frame_id=frame), UncertainPose(pose, tuple(covariance.ravel().tolist())))


@dataclass(frozen=True)
class Placement:
    """A `geometry_msgs/Transform`."""

    translation: Vector = field(default_factory=Vector)
    rotation: Turn = field(default_factory=Turn)


@dataclass(frozen=True)
class StampedTransform:
    """Where a frame is in that of its header."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    transform: Placement = field(default_factory=Placement)


@dataclass(frozen=True)
class Transforms:
    """A `tf2_msgs/TFMessage`."""

    transforms: tuple[StampedTransform, ...] = ()


def transform(frame: str, child: str, position: np.ndarray, quaternion: np.ndarray) -> Transforms:
    """Make a transform: where `child` is in `frame`, shape (3,) [m], quaternion (x, y, z, w)."""
    placed = Placement(Vector(*position.tolist()), Turn(*quaternion.tolist()))
    return Transforms((StampedTransform(Header(frame_id=frame), child, placed),))
