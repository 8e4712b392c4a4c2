"""Contacts of a robot with the ground: points and wheels, which may be lifted, and the forces that act on them."""

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import PointError
from solfer.model.contacts import ContactRecord
from solfer.model.view import RobotView
from solfer.points.compiled import layout
from solfer.points.contact.support_vertex import UP, SupportVertex
from solfer.points.point import Arrangement, Point
from solfer.points.rigid import LinearPoint


class Contact(Point):
    """Base class of contacts: they may be lifted, and the ground acts on them."""

    link: str
    _wrench: np.ndarray

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
        Arrangement.version += 1

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
    """A point of a link that touches the ground: its position in the world [m].

    Args:
        link: Name of the link.
        robot: The Robot.
        offset: The point in the frame of the link, shape (3,) [m].

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: The offset is not three finite numbers.
    """

    def __init__(self, link: str, robot: RobotView, offset: ArrayLike = (0.0, 0.0, 0.0)):
        super().__init__(link, robot, offset)
        self._wrench = np.zeros(6)


class RollingContact(SupportVertex, Contact):
    """The point where a wheel touches the ground [m]; the Jacobian is that of the wheel's material there.

    A wheel that rolls without slip has Jacobian times velocity zero, while the point itself moves along. Arguments:
    `SupportVertex`.
    """

    operation = layout.ROLLING

    def __init__(
        self,
        link: str,
        robot: RobotView,
        ring: float,
        tube: float,
        axis: ArrayLike = UP,
        center: ArrayLike = (0.0, 0.0, 0.0),
        normal: ArrayLike = UP,
    ):
        super().__init__(link, robot, ring, tube, axis, center, normal)
        self._wrench = np.zeros(6)


def make_contact(record: ContactRecord, robot: RobotView) -> PointContact | RollingContact:
    """Build the contact of a record.

    Raises:
        UnknownName: The robot has no such link.
        PointError: A wheel without its radii or its axis.
    """
    where = record.where("end_frame")
    robot.kinematics.frame(record.end_frame, where)
    if record.type == "contact_point":
        contact: PointContact | RollingContact = PointContact(record.end_frame, robot, record.position)
    elif record.minor_axis is None or record.major_axis is None or record.reference_axis is None:
        raise PointError(
            f"wheel '{record.name}' is not described", where=where, expected="minor_axis, major_axis and reference_axis"
        )
    else:
        axis = record.reference_axis
        contact = RollingContact(
            record.end_frame, robot, record.major_axis, record.minor_axis, (axis.x, axis.y, axis.z), record.position
        )
    contact.active = record.active
    return contact
