"""Pipes of contacts: wrenches of the ground on the Robot, received from sensors or plugins, and published.

A message has the wrench as a sensor in the link measures it: force, and torque about the origin of the contact's link.
A `Contact` has the torque about the contact itself, in world axes. They differ by the arm from the link to the contact.
"""

from collections.abc import Collection, Sequence

import numpy as np

from solfer.components.port import Port
from solfer.numerics.rotations import cross
from solfer.pipes.point.pipes import PointCommandPipe, PointFeedbackPipe
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot
from solfer.transport.endpoints import MessageStatus, Reader, Writer
from solfer.transport.messages import Message

WORLD = "world"


def _frame(contacts: Sequence[Contact], fixed: bool) -> str:
    return contacts[0].link if fixed else WORLD


def _arm(robot: Robot, contact: Contact) -> np.ndarray:
    """Compute the arm from the origin of a contact's link to the contact, world axes, shape (3,) [m]."""
    return contact.value - robot.kinematics.position(contact.link)


def _bring_up_to_date(robot: Robot) -> None:
    """Update kinematics and contacts to the measured State."""
    robot.update()
    _ = robot.contacts  # computed on access


class ContactFeedbackPipe(PointFeedbackPipe):
    """Writes received wrenches to contacts of the Robot.

    Positions of the contacts and rotations of their links are those of the Robot's State when the message is read.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        robot: The Robot.
        contacts: Its contacts in the messages.
        fixed: Whether the one contact's wrench is in the axes of its link; else in those of the world.
        names: Names of the contacts, for messages of several; None: messages of one contact.
        required: Whether the plugin has to wait for this pipe before it starts.
        known: Other names that a message may contain; None: any.
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
        self._published = port.value.reshape(-1, 6)
        self._brought: Sequence[int] | np.ndarray = range(len(contacts))

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        status = super().run()
        if status is MessageStatus.NEW:
            _bring_up_to_date(self._robot)
            for index in self._brought:
                self._write(self._contacts[index], self._published[index])
        return status

    def _copy_named(self, message: Message) -> None:
        super()._copy_named(message)
        target = self._names.match(message.names).target
        self._brought = range(len(self._contacts)) if target is None else target

    def _write(self, contact: Contact, published: np.ndarray) -> None:
        force, torque = contact.wrench[:3], contact.wrench[3:]
        force[:], torque[:] = published[:3], published[3:]
        if self._fixed:
            rotation = self._robot.kinematics.rotation(contact.link)
            np.matmul(rotation, published[:3], out=force)
            np.matmul(rotation, published[3:], out=torque)
        torque -= cross(_arm(self._robot, contact), force)


class ContactCommandPipe(PointCommandPipe):
    """Publishes the wrenches of contacts of the Robot; values that are NaN or infinite are not sent.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        robot: The Robot.
        contacts: Its contacts in the messages.
        fixed: Whether the one contact's wrench is in the axes of its link; else in those of the world.
        names: Names of the contacts, for messages of several; None: messages of one contact.
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
        self._published = port.value.reshape(-1, 6)

    def collect(self) -> None:
        """See `CommandPipe.collect`."""
        _bring_up_to_date(self._robot)
        for contact, published in zip(self._contacts, self._published, strict=True):
            self._read(contact, published)
        super().collect()

    def _read(self, contact: Contact, published: np.ndarray) -> None:
        force, torque = contact.wrench[:3], contact.wrench[3:] + cross(_arm(self._robot, contact), contact.wrench[:3])
        if self._fixed:
            rotation = self._robot.kinematics.rotation(contact.link)
            np.matmul(force, rotation, out=published[:3])
            np.matmul(torque, rotation, out=published[3:])
        else:
            published[:3], published[3:] = force, torque
