"""Contacts of a robot with the ground: points, balls and wheels, which may be lifted, and the forces on them."""

import abc
import math

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, PointError, SizeMismatch
from solfer.model.contacts import ContactRecord
from solfer.model.view import RobotView
from solfer.points.compiled.instruction import SMALLEST_LENGTH
from solfer.points.compiled.wheels import rolling
from solfer.points.contact.support_vertex import UP, SupportVertex
from solfer.points.offset import direction
from solfer.points.point import Point
from solfer.points.rigid import LinearPoint

__all__ = ["BallContact", "PointContact", "RollingContact", "make_contact"]


class Contact(Point, abc.ABC):
    """Base class of contacts: they may be lifted, and the ground acts on them.

    A contact has a frame of its own, and its `constraint` says what it keeps the link's material from doing there. The
    value is the position of the contact in the world, and its Jacobian is in world axes; what the contact constrains
    is a `ContactConstraint`.
    """

    link: str
    _wrench: np.ndarray
    _constraint: np.ndarray

    def _hold(self, constraint: ArrayLike | None) -> None:
        """Set what acts on the contact, and the rows that it constrains; None: the three forces."""
        self._wrench, self._rotation = np.zeros(6), np.eye(3)
        rows = np.eye(3, 6) if constraint is None else np.array(constraint, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != 6 or not 1 <= len(rows) <= 6:
            raise SizeMismatch(f"{self} with a constraint of shape {rows.shape}", expected="one to six rows of 6")
        if not np.isfinite(rows).all() or not rows.any(axis=1).all():
            raise NotFinite(f"{self} with the constraint {rows.tolist()}", expected="finite rows that are not zero")
        rows.flags.writeable = False
        self._constraint = rows

    @property
    def constraint(self) -> np.ndarray:
        """Directions that it constrains in its own frame: three forces, then three moments; shape (k, 6)."""
        return self._constraint

    @property
    def holds_a_point(self) -> bool:
        """Whether it constrains the forces along all three directions, and no moment."""
        return not self._constraint[:, 3:].any() and np.linalg.matrix_rank(self._constraint) == 3

    @property
    @abc.abstractmethod
    def rotation(self) -> np.ndarray:
        """Rotation from its frame to the world at the last update of the Robot, shape (3, 3); live, read only."""

    @abc.abstractmethod
    def spin(self, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
        """Return the angular velocity of its frame where that of the link is (wx, wy, wz), world axes [rad/s]."""

    @property
    def wrench(self) -> np.ndarray:
        """Force, then torque about the contact, of the ground on the robot in world axes, shape (6,) [N, Nm].

        Live; its source, a measurement or an estimate, writes or assigns it.
        """
        return self._wrench

    @wrench.setter
    def wrench(self, values: np.ndarray) -> None:
        self._wrench[:] = values

    def move_wrench(self, wrench: np.ndarray) -> None:
        """Store the wrench in another array from now on, shape (6,); its numbers are copied there."""
        wrench[:] = self._wrench
        self._wrench = wrench
        self._layout.change()

    @property
    def force(self) -> np.ndarray:
        """Force of the ground on the robot in world axes, shape (3,) [N]; live."""
        return self.wrench[:3]

    @property
    def active(self) -> bool:
        """Whether it touches the ground. The Jacobian of a lifted contact is zero from the next update on."""
        return not self._flags[1]

    @active.setter
    def active(self, active: bool) -> None:
        self._flags[:] = 1, not active


class PointContact(LinearPoint, Contact):
    """A point of a link that touches the ground: its position in the world [m]. Its frame has the axes of the link.

    Args:
        link: Name of the link.
        robot: The Robot.
        offset: The point in the frame of the link, shape (3,) [m].
        constraint: Directions that it constrains, see `Contact.constraint`; None: the three forces.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: The offset is not three finite numbers, or the constraint does not fit.
    """

    def __init__(
        self,
        link: str,
        robot: RobotView,
        offset: ArrayLike = (0.0, 0.0, 0.0),
        constraint: ArrayLike | None = None,
    ):
        super().__init__(link, robot, offset)
        self._hold(constraint)

    @property
    def rotation(self) -> np.ndarray:
        """See `Contact.rotation`."""
        return self.robot.kinematics.rotation(self.link)

    def spin(self, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
        """See `Contact.spin`: the frame turns with the link."""
        return wx, wy, wz


class RollingContact(SupportVertex, Contact):
    """The point where a wheel touches the ground [m]; the Jacobian is that of the wheel's material there.

    A wheel that rolls without slip has Jacobian times velocity zero, while the point itself moves along. Its frame has
    z along the ground's normal, y along the part of the axle across it, and x in the direction of rolling. Arguments:
    `SupportVertex`, and `constraint` as in `PointContact`.
    """

    kernels = (rolling,)

    def __init__(  # noqa: PLR0913, PLR0917 for users: the shape of a wheel, by its names
        self,
        link: str,
        robot: RobotView,
        ring: float,
        tube: float,
        axis: ArrayLike = UP,
        center: ArrayLike = (0.0, 0.0, 0.0),
        normal: ArrayLike = UP,
        constraint: ArrayLike | None = None,
    ):
        super().__init__(link, robot, ring, tube=tube, axis=axis, center=center, normal=normal)
        self._axle = direction(axis, f"axis of wheel '{link}'")
        self._hold(constraint)

    @property
    def rotation(self) -> np.ndarray:
        """See `Contact.rotation`."""
        (ax, ay, az), (nx, ny, nz), _ = self._axes()
        self._rotation[:] = (
            (ay * nz - az * ny, ax, nx),
            (az * nx - ax * nz, ay, ny),
            (ax * ny - ay * nx, az, nz),
        )
        return self._rotation

    def spin(self, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
        """See `Contact.spin`: the frame turns about the normal n as the axle a does, at (n x a).(w x a) / |n x a|^2."""
        (ax, ay, az), (nx, ny, nz), length = self._axes()
        if length <= SMALLEST_LENGTH:
            return 0.0, 0.0, 0.0
        # with y across the normal and a = length y + along n: w x a, along n x y
        bx, by, bz = (self.robot.kinematics.rotation(self.link) @ self._axle).tolist()
        tx = ny * az - nz * ay
        ty = nz * ax - nx * az
        tz = nx * ay - ny * ax
        rate = tx * (wy * bz - wz * by) + ty * (wz * bx - wx * bz) + tz * (wx * by - wy * bx)
        rate /= length
        return rate * nx, rate * ny, rate * nz

    def _axes(self) -> tuple[tuple[float, float, float], tuple[float, float, float], float]:
        """Return the part y of the axle across the normal n, of length one, n, and the length of that part.

        A wheel that lies flat has no direction of rolling: y is then across n and the world's x.
        """
        bx, by, bz = (self.robot.kinematics.rotation(self.link) @ self._axle).tolist()
        nx, ny, nz = self._numbers[6:9].tolist()
        along = bx * nx + by * ny + bz * nz
        yx = bx - along * nx
        yy = by - along * ny
        yz = bz - along * nz
        length = math.sqrt(yx * yx + yy * yy + yz * yz)
        if length <= SMALLEST_LENGTH:
            return across(nx, ny, nz), (nx, ny, nz), 0.0
        return (yx / length, yy / length, yz / length), (nx, ny, nz), length


class BallContact(RollingContact):
    """The point below the centre of a ball where it touches the ground [m], which rolls there.

    The Jacobian is that of the ball's material. Its frame keeps its axes in the world: z along the ground's normal, y
    across it and the world's x.

    Args:
        link: Name of the ball's link.
        robot: The Robot.
        radius: Radius of the ball [m].
        center: Its centre in the frame of the link, shape (3,) [m].
        normal: Normal of the ground in the world, any length, shape (3,).
        constraint: As in `PointContact`.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: A vector is not three finite numbers, or the normal or the constraint does not fit.
        PointError: The radius is negative.
    """

    def __init__(
        self,
        link: str,
        robot: RobotView,
        radius: float,
        center: ArrayLike = (0.0, 0.0, 0.0),
        normal: ArrayLike = UP,
        *,
        constraint: ArrayLike | None = None,
    ):
        super().__init__(link, robot, 0.0, tube=radius, axis=UP, center=center, normal=normal, constraint=constraint)

    def _axes(self) -> tuple[tuple[float, float, float], tuple[float, float, float], float]:
        nx, ny, nz = self._numbers[6:9].tolist()
        return across(nx, ny, nz), (nx, ny, nz), 0.0


def across(nx: float, ny: float, nz: float) -> tuple[float, float, float]:
    """Return the unit vector across the direction (nx, ny, nz) and the world's x, or its y where the first is along x.

    It is y of a frame whose z is that direction; above flat ground its axes are those of the world.
    """
    length = math.hypot(ny, nz)
    if length > SMALLEST_LENGTH:
        return 0.0, nz / length, -ny / length
    return 0.0, 1.0, 0.0


def make_contact(record: ContactRecord, robot: RobotView) -> PointContact | RollingContact:
    """Build the contact of a record.

    A `contact_point` with an `offset` is a ball, whose radius is the offset's length; for both kinds, the ground's
    normal is opposite to the offset.

    Raises:
        UnknownName: The robot has no such link.
        PointError: A wheel without its radii or its axis.
    """
    where = record.where("end_frame")
    link = record.end_frame
    constraint = record.constraint_matrix.matrix()
    robot.kinematics.frame(link, where)
    down = np.array(record.offset or (0.0, 0.0, 0.0))
    normal = -down if down.any() else UP
    contact: PointContact | RollingContact
    if record.type == "contact_point" and down.any():
        contact = BallContact(
            link, robot, float(np.linalg.norm(down)), center=record.position, normal=normal, constraint=constraint
        )
    elif record.type == "contact_point":
        contact = PointContact(link, robot, record.position, constraint=constraint)
    elif record.minor_axis is None or record.major_axis is None or record.reference_axis is None:
        raise PointError(
            f"wheel '{record.name}' is not described", where=where, expected="minor_axis, major_axis and reference_axis"
        )
    else:
        axle = (record.reference_axis.x, record.reference_axis.y, record.reference_axis.z)
        contact = RollingContact(
            link,
            robot,
            record.major_axis,
            tube=record.minor_axis,
            axis=axle,
            center=record.position,
            normal=normal,
            constraint=constraint,
        )
    contact.active = record.active
    return contact
