"""Points of `wheeled_motion`: angles of wheels, pose of the base, and vertices along the rolling directions."""

import abc
import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from solfer.model.view import RobotView
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.pointers import address
from solfer.points import CenterOfMass, Point, SpatialPoint, SupportVertex
from solfer.points.compiled.frames import base_pose
from solfer.points.compiled.registry import Kernel
from solfer.points.compiled.wheels import camber, caster, rolling_offset
from solfer.points.program import CompiledPoint, Instruction, LinkMotion, folded
from solfer.robot import Robot


class WheelAngles(CompiledPoint, abc.ABC):
    """Angles of several wheels [rad]; a base class.

    Args:
        robot: The Robot.
        links: The links that the angles are those of.
        axes: Axle of each wheel in the frame of its link, shape (m, 3).
    """

    kernel: ClassVar[Kernel]

    def __init__(self, robot: RobotView, links: Sequence[str], axes: np.ndarray):
        super().__init__(len(links), robot)
        self._attachments = [robot.kinematics.attachment(link) for link in links]
        turned = [each.rotation @ axis for each, axis in zip(self._attachments, axes, strict=True)]
        self._numbers = [
            np.concatenate((axle, each.rotation[:, 2])) for axle, each in zip(turned, self._attachments, strict=True)
        ]

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move a link, shape (m,)."""
        return np.unique(np.concatenate([each.moved for each in self._attachments]))

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        own = [
            Instruction(
                self.kernel,
                self,
                numbers=numbers,
                table=np.array([index]),
                motion=LinkMotion(each.joint),
                columns=each.columns,
            )
            for index, (each, numbers) in enumerate(zip(self._attachments, self._numbers, strict=True))
        ]
        return folded(self, np.unique(np.concatenate([each.columns for each in self._attachments])), *own)


class Camber(WheelAngles):
    """Camber of wheels [rad]: how far a wheel's plane is tilted against the ground's normal, -asin(axle's z)."""

    kernel = camber


class Caster(WheelAngles):
    """Caster of wheels [rad]: how far the axis of steering is tilted against the ground's normal, about the axle.

    With the axis u of steering, z of the link that carries the wheel, the axle n and the normal z of the ground:
    atan2(z.(n x u), z.u).
    """

    kernel = caster


class BasePose(CompiledPoint):
    """Orientation, then position of the base: rows of angular velocity, then of velocity, world axes.

    The value has zeros for the orientation, whose error is a matter of its own, and the position [m]: that of the
    base's link, or x and y of the centre of mass.

    Args:
        robot: The Robot.
        pose: Pose of the base's link.
        center: Centre of mass.
        is_tracked: Whether x and y are those of the centre of mass.
    """

    def __init__(self, robot: RobotView, pose: SpatialPoint, center: CenterOfMass, is_tracked: bool = False):
        super().__init__(6, robot)
        self.pose = pose
        self.center = center
        self._operands = (pose, center) if is_tracked else (pose,)

    @property
    def parts(self) -> tuple[Point, ...]:
        """The pose, and the centre of mass, whose place in the support polygon counts where it is not tracked, too."""
        return self.pose, self.center

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move what is tracked, shape (m,)."""
        return np.unique(np.concatenate([part.columns for part in self._operands]))

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(base_pose, self, self._operands),)


class RollingOffsets(CompiledPoint):
    """Distances of the wheels' vertices behind their references along the rolling directions [m], negative.

    A vertex p has the reference r in the frame of the base's heading: with the rotation R about z by the heading and
    the base's place b, the offset is x.((p - b) - R r), where x is the direction of rolling. What is across x is a
    matter of steering. The Jacobian is that of a frame that turns with the heading, at the reference.

    The vertex of a wheel that is lifted is free: its offsets across x and upwards count, too. There are rows along x
    for all wheels, then across it, then upwards; the latter two are zero for wheels on the ground.

    Args:
        robot: The Robot.
        vertices: The vertices.
        axes: Axle of each wheel in the frame of its link, shape (m, 3).
        pose: Pose of the base's link.
        is_late: Whether place and Jacobian of the base are those of the cycle before, as in the original program.

    Attributes:
        vertices, axes, is_late: See above.
        reference: Desired vertices in the frame of the heading: x, y from the base, z in the world, shape (m, 3) [m].
        states: Vertices in that frame, with the base's present place, shape (m, 3) [m].
        errors: Reference minus vertex in that frame, with the base's place that counts, shape (m, 3) [m].
        directions: The directions of rolling in the world, shape (m, 2).
        lifted: Which wheels are lifted, shape (m,).
        base: Heading of the base [rad], and its x and y of the cycle before [m], shape (3,).
    """

    def __init__(
        self,
        robot: RobotView,
        vertices: Sequence[SupportVertex],
        axes: np.ndarray,
        pose: SpatialPoint,
        is_late: bool = False,
    ):
        count = len(vertices)
        super().__init__(3 * count, robot)
        self.vertices = tuple(vertices)
        self.axes = axes
        self._pose = pose
        self.is_late = is_late
        self._attachments = [robot.kinematics.attachment(vertex.link) for vertex in vertices]
        self._numbers = np.zeros(14 * count + 3)
        blocks = self._numbers[: 9 * count].reshape(3, count, 3)
        self.reference, self.states, self.errors = blocks
        self.directions = self._numbers[9 * count : 11 * count].reshape(count, 2)
        axles = self._numbers[11 * count : 14 * count].reshape(count, 3)
        axles[:] = [each.rotation @ axis for each, axis in zip(self._attachments, axes, strict=True)]
        self.base = self._numbers[14 * count :]
        self.lifted = np.zeros(count, dtype=bool)
        self._base_rows = np.zeros((2, self.cols))

    @property
    def heading(self) -> float:
        """Heading of the base [rad]."""
        return float(self.base[0])

    @property
    def parts(self) -> tuple[Point, ...]:
        """The vertices, and the pose of the base."""
        return *self.vertices, self._pose

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move a vertex or the base, shape (m,)."""
        return np.unique(np.concatenate([part.columns for part in self.parts]))

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        late = address(self._base_rows) if self.is_late else 0
        found = []
        for index, (vertex, each) in enumerate(zip(self.vertices, self._attachments, strict=True)):
            one = Instruction(
                rolling_offset,
                self,
                (vertex, self._pose),
                numbers=self._numbers,
                table=np.array([index, len(self.vertices), address(self.lifted), late]),
                motion=LinkMotion(each.joint),
                columns=np.union1d(vertex.columns, self._pose.columns),
            )
            one.arrays += [self.lifted, self._base_rows]
            found.append(one)
        return tuple(found)

    def start(self) -> None:
        """Begin with vertices where they are; all parts are up to date."""
        self.base[1:] = self._pose.value[:2]
        self._base_rows[:] = 0.0
        self.update(jacobian=False)
        self.reference[:] = self.states
        self.errors[:] = 0.0

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped."""
        self.base[0] = move.rotate_heading(self.heading)
        move.move(self.base[1:])
        self.states[:, 2] += move.rise

    def remember(self) -> None:
        """Take over the base of this cycle for the next one; called where it is late."""
        self.base[1:], self._base_rows[:] = self._pose.value[:2], self._pose.jacobian[:2]


def heading_of(pose: np.ndarray) -> float:
    """Return the heading of a pose, the twist of its quaternion about z [rad], from -pi to pi."""
    return wrapped(2.0 * math.atan2(pose[5], pose[6]), 2.0 * math.pi)


def wrapped(angle: float, period: float) -> float:
    """Return the angle in [-period / 2, period / 2) [rad]."""
    return angle - period * math.floor(angle / period + 0.5)


def carrier_of(robot: Robot, wheel: str) -> str:
    """Return the link that carries a wheel."""
    description = robot.description
    joint = description.links[wheel].parent
    return wheel if joint is None else description.joints[joint].parent
