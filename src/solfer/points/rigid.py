"""Points and frames on the links of a Robot: positions, orientations, velocities."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import PointError
from solfer.model.view import RobotView
from solfer.points.compiled.instruction import ANGULAR, LINEAR
from solfer.points.compiled.registry import Kernel
from solfer.points.compiled.rigid import place, velocity
from solfer.points.offset import OrientationOffset, PositionOffset, quaternion_convention
from solfer.points.program import CompiledPoint, Instruction, LinkMotion, folded
from solfer.points.space import ORIENTATION, POSE, Space, vector

__all__ = ["AngularVelocity", "FrameOrientation", "LinearPoint", "LinearVelocity", "SpatialPoint", "SpatialVelocity"]


class LinkPoint(CompiledPoint):
    """A point of one link, computed by operations that have the same parameters; a base class.

    Args:
        space: Space of the value.
        link: Name of the link.
        robot: The Robot.
        count: Number of the parameters, which the subclass writes to `_numbers`.

    Attributes:
        link: Name of the link.

    Raises:
        UnknownName: The robot has no such link.
    """

    kernels: ClassVar[tuple[Kernel, ...]]
    motion: ClassVar[int] = LINEAR

    def __init__(self, space: Space, link: str, robot: RobotView, count: int):
        self._attachment = robot.kinematics.attachment(link)
        super().__init__(space, robot)
        self.link = link
        self._joint = self._attachment.joint
        self._moving = self._attachment.moved
        self._carried = self._attachment.columns
        self._numbers = np.zeros(count)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        columns = self._carried if self._carried is not self._moving else None
        own = [
            Instruction(
                kernel,
                self,
                numbers=self._numbers,
                motion=LinkMotion(self._joint, self.motion, self.written_offset),
                columns=columns,
            )
            for kernel in self.kernels
        ]
        return folded(self, self._carried, *own)

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move the link, shape (m,)."""
        return self._moving

    def share_place(self, other: "LinkPoint") -> None:
        """Be where another point of the same link is, also when that is set to another place.

        Raises:
            PointError: It is on another link, or its place is given by other parameters.
        """
        if other.link != self.link or len(other._numbers) != len(self._numbers):
            raise PointError(f"{self} cannot be where {other} is", expected="points of one link and of one kind")
        self._numbers = other._numbers
        self._layout.change()

    def __str__(self) -> str:
        return f"{type(self).__name__} of '{self.link}', {self.space}"


class RigidPoint(LinkPoint):
    """A quantity that moves with one link, at a point with axes of its own; a base class.

    Args:
        link: Name of the link.
        robot: The Robot.

    Raises:
        UnknownName: The robot has no such link.
    """

    kind: ClassVar[Space]

    def __init__(self, link: str, robot: RobotView):
        super().__init__(self.kind, link, robot, count=7)
        self._position = PositionOffset(robot, link, self._attachment, numbers=self._numbers[:3])
        self._orientation = OrientationOffset(robot, link, self._attachment, numbers=self._numbers[3:])

    def share_place(self, other: LinkPoint) -> None:
        """See `LinkPoint.share_place`."""
        super().share_place(other)
        self._position.share(self._numbers[:3])
        self._orientation.share(self._numbers[3:])


class LinearPoint(RigidPoint):
    """Position of a point on a link in the world [m].

    Args:
        link: Name of the link.
        robot: The Robot.
        offset: The point in the frame of the link, shape (3,) [m].

    Attributes:
        position: Place of the point on the link; `set_fixed`, `set_world` and `set_reference` are its own.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: The offset is not three finite numbers.
    """

    kind = vector(3)
    kernels: ClassVar[tuple[Kernel, ...]] = (place,)

    def __init__(self, link: str, robot: RobotView, offset: ArrayLike = (0.0, 0.0, 0.0)):
        super().__init__(link, robot)
        self.position = self._position
        self.set_fixed = self.position.set_fixed
        self.set_world = self.position.set_world
        self.set_reference = self.position.set_reference
        self.set_fixed(offset)


class FrameOrientation(RigidPoint):
    """Orientation of a frame on a link: the unit quaternion (x, y, z, w), w >= 0, that rotates from it to the world.

    Its Jacobian has three rows and maps to the angular velocity in world axes [rad/s].

    Args:
        link: Name of the link.
        robot: The Robot.
        offset: Quaternion that rotates from the frame to the link, shape (4,).

    Attributes:
        orientation: Orientation of the frame on the link; `set_fixed`, `set_world` and `set_reference` are its own.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: The offset is not a quaternion.
    """

    kind = ORIENTATION
    kernels = (place,)
    motion = ANGULAR

    def __init__(self, link: str, robot: RobotView, offset: ArrayLike = (0.0, 0.0, 0.0, 1.0)):
        super().__init__(link, robot)
        self.orientation = self._orientation
        self.set_fixed = self.orientation.set_fixed
        self.set_world = self.orientation.set_world
        self.set_reference = self.orientation.set_reference
        self.set_fixed(offset)

    def quaternion(self, order: str = "xyzw", kind: str = "HAMILTONIAN") -> np.ndarray:
        """Return the value in another convention, shape (4,); a new array.

        Raises:
            UnknownName: There is no such convention.
        """
        return quaternion_convention(order, kind).write(self.value, np.empty(4))


class SpatialPoint(RigidPoint):
    """Pose of a frame on a link: position in the world [m], then quaternion (x, y, z, w), w >= 0.

    Its Jacobian has six rows and maps to the linear, then the angular velocity in world axes [m/s, rad/s].

    Args:
        link: Name of the link.
        robot: The Robot.
        offset: Origin of the frame in the frame of the link, shape (3,) [m].
        orientation: Quaternion that rotates from the frame to the link, shape (4,).

    Attributes:
        position: Place of the frame's origin on the link.
        orientation: Orientation of the frame on the link.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: An offset does not fit.
    """

    kind = POSE
    kernels = (place,)
    motion = LINEAR + ANGULAR

    def __init__(
        self,
        link: str,
        robot: RobotView,
        offset: ArrayLike = (0.0, 0.0, 0.0),
        orientation: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    ):
        super().__init__(link, robot)
        self.position = self._position
        self.orientation = self._orientation
        self.set_fixed(offset, orientation)

    def set_fixed(self, position: ArrayLike, orientation: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> None:
        """Set origin [m] and quaternion of the frame in the frame of the link; see `PositionOffset.set_fixed`."""
        self.position.set_fixed(position)
        self.orientation.set_fixed(orientation)

    def set_world(self, position: ArrayLike, orientation: ArrayLike) -> None:
        """Set origin [m] and quaternion of the frame in the world; see `PositionOffset.set_world`."""
        self.position.set_world(position)
        self.orientation.set_world(orientation)

    def set_reference(self, position: ArrayLike, orientation: ArrayLike, link: str) -> None:
        """Set origin [m] and quaternion of the frame in another link; see `PositionOffset.set_reference`."""
        self.position.set_reference(position, link)
        self.orientation.set_reference(orientation, link)


class LinearVelocity(LinearPoint):
    """Velocity of a point on a link in world axes [m/s]; the Jacobian is that of the point.

    Arguments: `LinearPoint`.
    """

    kernels = (velocity,)


class AngularVelocity(RigidPoint):
    """Angular velocity of a link in world axes [rad/s]; the Jacobian is that of its orientation.

    Args:
        link: Name of the link.
        robot: The Robot.

    Raises:
        UnknownName: The robot has no such link.
    """

    kind = vector(3)
    kernels = (velocity,)
    motion = ANGULAR


class SpatialVelocity(LinearPoint):
    """Velocity of a point on a link, then angular velocity of the link, world axes [m/s, rad/s].

    Arguments: `LinearPoint`.
    """

    kind = vector(6)
    kernels = (velocity,)
    motion = LINEAR + ANGULAR
