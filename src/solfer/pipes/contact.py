"""Pipes of contacts: what the ground does to the Robot, from sensors or other plugins, and told to others.

A wrench travels as a sensor in the link tells it: force, and torque about the origin of the contact's link. A `Contact`
has the torque about the contact itself, in world axes. Between them lies the arm from the link to the contact.
"""

from collections.abc import Collection, Sequence

import numpy as np

from solfer.components.port import Port
from solfer.numerics.rotations import cross
from solfer.pipes.endpoints import Reader, Status, Writer
from solfer.pipes.messages import PointsMessage
from solfer.pipes.point import PointController, PointFeedback
from solfer.points.contacts import Contact
from solfer.robot import Robot

WORLD = "world"


def _frame(contacts: Sequence[Contact], fixed: bool) -> str:
    return contacts[0].link if fixed else WORLD


def _arm(robot: Robot, contact: Contact) -> np.ndarray:
    """From the origin of a contact's link to the contact, world axes, shape (3,) [m]."""
    return contact.value - robot.kinematics.position(contact.link)


def _bring_up_to_date(robot: Robot) -> None:
    """Kinematics and contacts at what the measured State says now."""
    robot.update()
    _ = robot.contacts  # computed when somebody asks for them


class ContactFeedback(PointFeedback):
    """Writes what others tell of the ground to contacts of the Robot.

    Where the contacts are and how their links are turned is what the Robot's State says when the message is read.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        robot: The Robot.
        contacts: Its contacts that the messages are about.
        fixed: Whether the one contact's wrench comes in the axes of its link; else in those of the world.
        names: Names of several contacts, for messages that hold several; None: messages are about the one contact.
        required: Whether the plugin has to wait for this pipe before it starts.
        known: Names that a message may bring besides; None: any.
    """

    what = "contact"

    def __init__(
        self,
        name: str,
        reader: Reader,
        robot: Robot,
        contacts: Sequence[Contact],
        fixed: bool = False,
        names: tuple[str, ...] | None = None,
        required: bool = True,
        known: Collection[str] | None = (),
    ):
        port = Port("wrench", None if names is None else len(contacts))
        super().__init__(name, reader, port, _frame(contacts, fixed), names, required, known)
        self._robot, self._contacts, self._fixed = robot, tuple(contacts), fixed
        self._told, self._brought = port.value.reshape(-1, 6), range(len(contacts))

    def run(self) -> Status:
        """See `Feedback.run`."""
        status = super().run()
        if status is Status.NEW:
            _bring_up_to_date(self._robot)
            for index in self._brought:
                self._write(self._contacts[index], self._told[index])
        return status

    def _take_named(self, message: PointsMessage) -> None:
        super()._take_named(message)
        target = self._names.match(message.names).target
        self._brought = range(len(self._contacts)) if target is None else target

    def _write(self, contact: Contact, told: np.ndarray) -> None:
        force, torque = contact.wrench[:3], contact.wrench[3:]
        force[:], torque[:] = told[:3], told[3:]
        if self._fixed:
            rotation = self._robot.kinematics.rotation(contact.link)
            np.matmul(rotation, told[:3], out=force)
            np.matmul(rotation, told[3:], out=torque)
        torque -= cross(_arm(self._robot, contact), force)


class ContactController(PointController):
    """Tells the wrenches of contacts of the Robot; numbers that are not finite are not sent.

    Args:
        name: Name of the pipe in the configuration.
        writer: Where the messages go.
        robot: The Robot.
        contacts: Its contacts that the messages are about.
        fixed: Whether the one contact's wrench is told in the axes of its link; else in those of the world.
        names: Names of several contacts, for messages that hold several; None: messages are about the one contact.
    """

    def __init__(
        self,
        name: str,
        writer: Writer,
        robot: Robot,
        contacts: Sequence[Contact],
        fixed: bool = False,
        names: tuple[str, ...] | None = None,
    ):
        port = Port("wrench", None if names is None else len(contacts))
        super().__init__(name, writer, port, _frame(contacts, fixed), names)
        self._robot, self._contacts, self._fixed = robot, tuple(contacts), fixed
        self._told = port.value.reshape(-1, 6)

    def collect(self) -> None:
        """See `Controller.collect`."""
        _bring_up_to_date(self._robot)
        for contact, told in zip(self._contacts, self._told, strict=True):
            self._read(contact, told)
        super().collect()

    def _read(self, contact: Contact, told: np.ndarray) -> None:
        force, torque = contact.wrench[:3], contact.wrench[3:] + cross(_arm(self._robot, contact), contact.wrench[:3])
        if self._fixed:
            rotation = self._robot.kinematics.rotation(contact.link)
            np.matmul(force, rotation, out=told[:3])
            np.matmul(torque, rotation, out=told[3:])
        else:
            told[:3], told[3:] = force, torque
