"""Points of `wheeled_motion`: angles of wheels, pose of the base, and vertices along the wheels' ways of rolling."""

import abc
import math
from collections.abc import Sequence

import numpy as np

from solfer.model.view import RobotView
from solfer.points import CenterOfMass, Point, SpatialPoint, SupportVertex
from solfer.robot import Robot

PERIOD = math.pi
"""Steering, camber and caster are the same for a wheel that has turned by half a turn."""

ROUNDED = 3.14159265
"""Half a turn in the original program; its whole turn is that of `ROUNDED_TURN`."""

ROUNDED_TURN = 6.28318531


class WheelAngles(Point):
    """Angles of several wheels [rad]; a base class.

    Args:
        robot: The Robot.
        poses: Poses of the links that the angles are those of.
        axes: Axle of each wheel in the frame of its link, shape (m, 3).
    """

    def __init__(self, robot: RobotView, poses: Sequence[Point], axes: np.ndarray):
        super().__init__(len(poses), robot)
        self._poses, self._axes = tuple(poses), axes
        self._links = [pose.link for pose in poses]
        self._row = np.zeros(3)

    @property
    def parts(self) -> tuple[Point, ...]:
        """The poses of the links."""
        return self._poses

    def compute(self) -> None:
        """Write the angles."""
        for index, (rotation, axis) in enumerate(zip(self._rotations(), self._axes, strict=True)):
            self.value[index] = self.angle(rotation, *rotation.dot(axis).tolist())

    def compute_jacobian(self) -> None:
        """Write the Jacobian."""
        for index, (rotation, axis) in enumerate(zip(self._rotations(), self._axes, strict=True)):
            self._row[:] = self.row(rotation, *rotation.dot(axis).tolist())
            np.dot(self._row, self._poses[index].jacobian[3:], out=self.jacobian[index])

    def _rotations(self) -> list[np.ndarray]:
        return [self.robot.kinematics.rotation(link) for link in self._links]

    @abc.abstractmethod
    def angle(self, rotation: np.ndarray, x: float, y: float, z: float) -> float:
        """Return the angle of a link with this rotation, whose axle points to (x, y, z) in the world [rad]."""

    @abc.abstractmethod
    def row(self, rotation: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Return the map from the angular velocity of the link in world axes to the rate of the angle."""


class Camber(WheelAngles):
    """Camber of wheels [rad]: how far a wheel's plane leans against the ground's normal, -asin(axle's z)."""

    def angle(self, rotation: np.ndarray, x: float, y: float, z: float) -> float:
        """See `WheelAngles.angle`."""
        return -math.asin(min(max(z, -1.0), 1.0))

    def row(self, rotation: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
        """See `WheelAngles.row`."""
        length = max(math.hypot(x, y), 1e-9)
        return -y / length, x / length, 0.0


class Caster(WheelAngles):
    """Caster of wheels [rad]: how far the axis of steering leans against the ground's normal, about the axle.

    With the axis u of steering, z of the link that carries the wheel, the axle n and the normal z of the ground:
    atan2(z.(n x u), z.u).
    """

    def angle(self, rotation: np.ndarray, x: float, y: float, z: float) -> float:
        """See `WheelAngles.angle`."""
        ux, uy, uz = rotation[:, 2].tolist()
        return math.atan2(x * uy - y * ux, uz)

    def row(self, rotation: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
        """See `WheelAngles.row`."""
        ux, uy, uz = rotation[:, 2].tolist()
        wx, wy, wz = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
        scale = 1.0 / max(uz * uz + wz * wz, 1e-18)
        # w x z and u x z, weighed by the parts of z along u and w
        return scale * (uz * wy - wz * uy), scale * (wz * ux - uz * wx), 0.0


class BasePose(Point):
    """Orientation, then position of the base: rows of angular velocity, then of velocity, world axes.

    The value has zeros for the orientation, whose error is a matter of its own, and the position [m]: that of the
    base's link, or x and y of the centre of mass.

    Args:
        robot: The Robot.
        pose: Pose of the base's link.
        center: Centre of mass, if its x and y count.
    """

    def __init__(self, robot: RobotView, pose: SpatialPoint, center: CenterOfMass | None = None):
        super().__init__(6, robot)
        self.pose, self.center = pose, center

    @property
    def parts(self) -> tuple[Point, ...]:
        """The pose, and the centre of mass."""
        return (self.pose,) if self.center is None else (self.pose, self.center)

    def compute(self) -> None:
        """Write the position."""
        self.value[3:] = self.pose.value[:3]
        if self.center is not None:
            self.value[3:5] = self.center.value[:2]

    def compute_jacobian(self) -> None:
        """Write the Jacobian."""
        self.jacobian[:3], self.jacobian[3:] = self.pose.jacobian[3:], self.pose.jacobian[:3]
        if self.center is not None:
            self.jacobian[3:5] = self.center.jacobian[:2]


class RollingOffsets(Point):
    """How far the vertices of wheels are behind their references along the ways in which the wheels roll [m], negative.

    A vertex p has the reference r in the frame of the base's heading: with the turn R about z by the heading and the
    base's place b, the offset is x.((p - b) - R r), where x is the direction of rolling. What is across x is a matter
    of steering. The Jacobian is that of a frame that turns with the heading, at the reference.

    The vertex of a wheel that is lifted is free: its offsets across x and upwards count, too. There are rows along x
    for all wheels, then across it, then upwards; the latter two are zero for wheels on the ground.

    Args:
        robot: The Robot.
        vertices: The vertices.
        axes: Axle of each wheel in the frame of its link, shape (m, 3).
        pose: Pose of the base's link.
        is_late: Whether place and Jacobian of the base are those of the cycle before, as in the original program.

    Attributes:
        vertices: The vertices.
        reference: Vertices wanted in the frame of the heading: x, y from the base, z in the world, shape (m, 3) [m].
        states: Vertices in that frame, with the base's present place, shape (m, 3) [m].
        errors: Reference minus vertex in that frame, with the base's place that counts, shape (m, 3) [m].
        directions: The directions of rolling in the world, shape (m, 2).
        lifted: Which wheels are lifted, shape (m,).
        heading: Heading of the base [rad].
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
        self.vertices, self._pose, self._is_late, self._axes = tuple(vertices), pose, is_late, axes
        self.reference, self.states, self.errors = np.zeros((3, count, 3))
        self.directions, self.heading = np.zeros((count, 2)), 0.0
        self.lifted = np.zeros(count, dtype=bool)
        self._base, self._base_rows = np.zeros(2), np.zeros((2, self.cols))
        self._part, self._across = np.zeros((2, self.cols)), np.zeros(2)

    @property
    def parts(self) -> tuple[Point, ...]:
        """The vertices, and the pose of the base."""
        return *self.vertices, self._pose

    def start(self) -> None:
        """Begin with vertices where they are; all parts are up to date."""
        self._base[:], self._base_rows[:] = self._pose.value[:2], 0.0
        self.heading = heading_of(self._pose.value)
        self.compute()
        self.reference[:] = self.states
        self.errors[:] = 0.0

    def remember(self) -> None:
        """Take over the base of this cycle for the next one, where it is late."""
        self._base[:], self._base_rows[:] = self._pose.value[:2], self._pose.jacobian[:2]

    def compute(self) -> None:
        """Write the offsets, and what else is known of the vertices."""
        pose = self._pose.value
        self.heading = heading_of(pose)
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        px, py = pose[:2].tolist()
        bx, by = self._base.tolist() if self._is_late else (px, py)
        count = len(self.vertices)
        for index, vertex in enumerate(self.vertices):
            x, y, _ = self.robot.kinematics.rotation(vertex.link).dot(self._axes[index]).tolist()
            length = max(math.hypot(x, y), 1e-9)
            fx, fy = y / length, -x / length
            vx, vy, vz = vertex.value.tolist()
            rx, ry, rz = self.reference[index].tolist()
            gx, gy = cos * rx - sin * ry, sin * rx + cos * ry
            ex, ey = gx - (vx - bx), gy - (vy - by)
            self.directions[index] = fx, fy
            self.states[index] = cos * (vx - px) + sin * (vy - py), cos * (vy - py) - sin * (vx - px), vz
            self.errors[index] = cos * ex + sin * ey, cos * ey - sin * ex, rz - vz
            self.value[index] = -(fx * ex + fy * ey)
            across, up = (fy * ex - fx * ey, vz - rz) if self.lifted[index] else (0.0, 0.0)
            self.value[count + index], self.value[2 * count + index] = across, up

    def compute_jacobian(self) -> None:
        """Write the Jacobian."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        base = self._base_rows if self._is_late else self._pose.jacobian[:2]
        turn = self._pose.jacobian[5]
        for index, vertex in enumerate(self.vertices):
            (fx, fy), (rx, ry, _) = self.directions[index].tolist(), self.reference[index].tolist()
            np.subtract(vertex.jacobian[:2], base, out=self._part)
            np.dot(self.directions[index], self._part, out=self.jacobian[index])
            gx, gy = cos * rx - sin * ry, sin * rx + cos * ry
            np.multiply(turn, fx * gy - fy * gx, out=self._part[0])
            self.jacobian[index] += self._part[0]
            self._compute_free(index, vertex, fx * gx + fy * gy)

    def _compute_free(self, index: int, vertex: SupportVertex, along: float) -> None:
        """Write the rows that count where a wheel is lifted; its reference is `along` its direction [m]."""
        count, (fx, fy) = len(self.vertices), self.directions[index].tolist()
        across, up = self.jacobian[count + index], self.jacobian[2 * count + index]
        if not self.lifted[index]:
            across[:], up[:] = 0.0, 0.0
            return
        base = self._base_rows if self._is_late else self._pose.jacobian[:2]
        np.subtract(vertex.jacobian[:2], base, out=self._part)
        self._across[:] = -fy, fx
        np.dot(self._across, self._part, out=across)
        np.multiply(self._pose.jacobian[5], along, out=self._part[0])
        across -= self._part[0]
        np.copyto(up, vertex.jacobian[2])


def heading_of(pose: np.ndarray) -> float:
    """Return the heading of a pose, the twist of its quaternion about z [rad], from -pi to pi."""
    return wrapped(2.0 * math.atan2(pose[5], pose[6]), 2.0 * math.pi)


def wrapped(angle: float, period: float = PERIOD) -> float:
    """Return the angle in [-period / 2, period / 2) [rad]."""
    return angle - period * math.floor(angle / period + 0.5)


def write_turn(orientation: np.ndarray, reference: np.ndarray, out: np.ndarray) -> None:
    """Write the vector part of the quaternion that turns an orientation to its reference, both (x, y, z, w)."""
    x, y, z, w = orientation.tolist()
    rx, ry, rz, rw = reference.tolist()
    out[:] = w * rx - rw * x - ry * z + rz * y, w * ry - rw * y - rz * x + rx * z, w * rz - rw * z - rx * y + ry * x
    # q and -q are the same orientation
    if w * rw + x * rx + y * ry + z * rz < 0.0:
        np.negative(out, out=out)


def nearest(angle: float, other: float, period: float = PERIOD) -> tuple[float, float]:
    """Return the angle nearest to another one among those that differ by half turns, and the sign of its direction.

    Of two that are equally near, it is the larger one.
    """
    turns = math.ceil((angle - other) / PERIOD - 0.5)
    return angle - turns * period, -1.0 if turns % 2 else 1.0


def carrier_of(robot: Robot, wheel: str) -> str:
    """Return the link that carries a wheel."""
    description = robot.description
    joint = description.links[wheel].parent
    return wheel if joint is None else description.joints[joint].parent
