"""Points that others are seen from: relative positions and poses, frames that stay level, and directions of sight."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import PointError, SizeMismatch
from solfer.model.view import RobotView
from solfer.points.algebra import Constant
from solfer.points.compiled import frames as kernels
from solfer.points.offset import direction, finite
from solfer.points.point import Operand, Point, common_robot
from solfer.points.program import CompiledPoint, Instruction
from solfer.points.space import ORIENTATION, POSE, vector

__all__ = ["GroundFrame", "LookAt", "RelativePoint", "WheelFrame"]

UP = (0.0, 0.0, 1.0)
"""Default of axles and normals."""


class RelativePoint(CompiledPoint):
    """Position, orientation or pose of a point as seen from a frame, in the axes of that frame.

    With the frame's origin c and rotation R: R' (p - c) [m], and R' times the orientation. Its Jacobian maps to the
    velocity of the point against the frame, in the axes of the frame. `update` computes it alone: both are updated
    before it.

    Args:
        point: A position, an orientation or a pose.
        frame: A pose: a `SpatialPoint`, a `GroundFrame`, a `WheelFrame`, or a Constant.

    Raises:
        SizeMismatch: One of them lies in another space.
        PointError: They belong to different Robots, or to none.
    """

    def __init__(self, point: Point, frame: Point):
        if point.space not in (vector(3), ORIENTATION, POSE) or frame.space != POSE:
            raise SizeMismatch(
                f"{point} as seen from {frame}", expected="a position, an orientation or a pose, as seen from a pose"
            )
        super().__init__(point.space, _robot_of(point, frame))
        self.point = point
        self.frame = frame

    @property
    def parts(self) -> tuple[Point, ...]:
        """Return the point and the frame."""
        return self.point, self.frame

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move one or the other, shape (m,)."""
        return np.union1d(self.point.columns, self.frame.columns)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(kernels.relative, self, self.parts),)


class _LevelFrame(CompiledPoint):
    """A frame whose z is the normal of the ground, at a pose; a base class.

    Args:
        pose: The pose; it is updated before this point.
        axis: Axis in the frame of the pose, shape (3,), whose part across the normal is the frame's x or y.
        normal: Normal of the ground in the world, any length, shape (3,).
        height: Height of the frame's origin along the normal, where it goes down to the ground [m].
    """

    falls: ClassVar[bool]
    crosses: ClassVar[bool]

    def __init__(self, pose: Point, axis: ArrayLike, normal: ArrayLike, height: float):
        if pose.space != POSE:
            raise SizeMismatch(f"{type(self).__name__} at {pose}", expected="a pose")
        super().__init__(POSE, _robot_of(pose))
        self.pose = pose
        self._numbers = np.zeros(9)
        self._numbers[:3] = direction(axis, f"axis of a {type(self).__name__}")
        self._numbers[3:6] = direction(normal, f"normal of a {type(self).__name__}")
        self._numbers[6:7] = finite([height], 1, f"height of a {type(self).__name__}")
        self._numbers[7:] = self.falls, self.crosses

    @property
    def parts(self) -> tuple[Point, ...]:
        """Return the pose."""
        return (self.pose,)

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move the pose, shape (m,)."""
        return self.pose.columns

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(kernels.level, self, self.parts, numbers=self._numbers),)


class GroundFrame(_LevelFrame):
    """Pose of a frame on the ground below a pose, such as that of the pelvis: z up, x where the pose is heading.

    Its x is the part of an axis of the pose across the normal; where there is none, it keeps the last one. Three of the
    six rows of its Jacobian are independent: it moves in the ground, and turns about the normal.

    Args:
        pose: The pose above it; it is updated before this point.
        height: Height of the ground along the normal [m].
        axis: Axis in the frame of the pose that shows forward, shape (3,).
        normal: Normal of the ground in the world, any length, shape (3,).

    Raises:
        SizeMismatch, NotFinite: It is not a pose, or a number does not fit.
        PointError: The pose has no Robot.
    """

    falls = True
    crosses = False

    def __init__(self, pose: Point, height: float = 0.0, axis: ArrayLike = (1.0, 0.0, 0.0), normal: ArrayLike = UP):
        super().__init__(pose, axis, normal, height=height)


class WheelFrame(_LevelFrame):
    """Pose of the frame in which a wheel rolls: z is the normal, y the part of the axle across it, x the direction.

    Its origin is that of the given pose. As seen from a `GroundFrame`, it turns about z by the steering angle.

    Args:
        pose: A pose on the link that carries the wheel, at the wheel's centre; it is updated before this point.
        axle: Axle of the wheel in the frame of the pose, shape (3,).
        normal: Normal of the ground in the world, any length, shape (3,).

    Raises:
        SizeMismatch, NotFinite: It is not a pose, or a number does not fit.
        PointError: The pose has no Robot.
    """

    falls = False
    crosses = True

    def __init__(self, pose: Point, axle: ArrayLike = UP, normal: ArrayLike = UP):
        super().__init__(pose, axle, normal, height=0.0)


class LookAt(CompiledPoint):
    """Direction from a frame to a target, in the axes of the frame: a vector of length one.

    With an axis of the frame as its reference, that axis turns to the target; a target right behind it is where the
    task does not know which way to turn. The target is a point of its own, such as a link or a Constant. A target at
    the frame's origin is in no direction: then it is zero.

    Args:
        frame: A pose; it is updated before this point.
        target: A position, updated before this point, or three numbers in the world [m].

    Attributes:
        target: The target.

    Raises:
        SizeMismatch, NotFinite: They are not a pose and a position.
        PointError: They belong to different Robots, or to none.
    """

    def __init__(self, frame: Point, target: Operand):
        target = target if isinstance(target, Point) else Constant(finite(target, 3, "target"))
        if frame.space != POSE or target.space != vector(3):
            raise SizeMismatch(f"a direction from {frame} to {target}", expected="a pose, and a position")
        super().__init__(3, _robot_of(frame, target))
        self.frame = frame
        self.target = target

    @property
    def parts(self) -> tuple[Point, ...]:
        """Return the frame and the target."""
        return self.frame, self.target

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move one or the other, shape (m,)."""
        return np.union1d(self.frame.columns, self.target.columns)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(kernels.sight, self, self.parts),)


def _robot_of(*points: Point) -> RobotView:
    robot = common_robot(*points)
    if robot is None:
        raise PointError(f"{points[0]} belongs to no Robot", expected="at least one point of a Robot")
    return robot
