"""Pipes of contacts: wrenches of the ground on the Robot, received from sensors or plugins, and published.

A message has the wrench as a sensor in the link measures it: force, and torque about the origin of the contact's link.
A `Contact` has the torque about the contact itself, in world axes. They differ by the arm from the link to the contact.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from solfer.interfaces.port import Port
from solfer.pipes.point.pipes import PointCommandPipe, PointFeedbackPipe, PointFormat
from solfer.points import Handler, LinearPoint
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot
from solfer.transport.endpoints import NEW, MessageStatus, Reader, Writer
from solfer.transport.messages import Message


@dataclass(frozen=True)
class CarriedContacts:
    """Contacts of a Robot in the messages of a pipe.

    Attributes:
        contacts: The contacts.
        fixed: Whether the one contact's wrench is in the axes of its link; else in those of the world.
        names: Their names, for messages of several; None: messages of one contact.
    """

    contacts: tuple[Contact, ...]
    fixed: bool = False
    names: tuple[str, ...] | None = None

    @property
    def format(self) -> PointFormat:
        """Format of the messages."""
        return PointFormat(self.contacts[0].link if self.fixed else "world", self.names)

    def port(self) -> Port:
        """Make a port for the wrenches."""
        return Port("wrench", None if self.names is None else len(self.contacts))


class _Wrenches:
    """Wrenches of some contacts of a Robot, and the same about the origins of their links in a message.

    Args:
        robot: The Robot.
        carried: Contacts of it.
        published: Numbers of the message, shape (k, 6).

    Attributes:
        all: Rows of the message, shape (k,).
    """

    def __init__(self, robot: Robot, carried: CarriedContacts, published: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.wrenches import shift

        self._shift = shift
        self._robot = robot
        self._contacts = carried.contacts
        self._published = published
        self._turned = np.zeros_like(published) if carried.fixed else published
        self._origins = Handler(LinearPoint(contact.link, robot) for contact in carried.contacts)
        self._places = self._origins.value.reshape(-1, 3)
        self.all = np.arange(len(published))
        self._memory = np.zeros((0, 6))
        self._positions = np.zeros((0, 3))
        self._read = self._written = np.zeros((0, 3), dtype=int)

    def write(self, places: np.ndarray) -> None:
        """Write rows of the message to their contacts."""
        self._bring_up_to_date()
        if self._turned is not self._published:
            np.matmul(self._published.reshape(2, 3), self._rotation().T, out=self._turned.reshape(2, 3))
        self._shift(self._turned, self._positions, self._places, self._written, -1.0, self._memory, places)

    def read(self) -> None:
        """Write the wrenches of all contacts to the message."""
        self._bring_up_to_date()
        self._shift(self._memory, self._positions, self._places, self._read, 1.0, self._turned, self.all)
        if self._turned is not self._published:
            np.matmul(self._turned.reshape(2, 3), self._rotation(), out=self._published.reshape(2, 3))

    def _rotation(self) -> np.ndarray:
        return self._robot.kinematics.rotation(self._contacts[0].link)

    def _bring_up_to_date(self) -> None:
        """Update kinematics, contacts and origins to the measured State, and find contacts that came or went."""
        self._robot.update()
        contacts = self._robot.contacts  # computed on access
        if contacts.wrenches is not self._memory:
            self._positions = contacts.positions
            self._memory, known = contacts.wrenches, [id(contact) for contact in contacts]
            members = np.array([known.index(id(each)) if id(each) in known else -1 for each in self._contacts])
            self._written = np.stack((self.all, members, members), axis=1)
            self._read = np.stack((members, members, self.all), axis=1)
        self._origins.update(jacobian=False)


class ContactFeedbackPipe(PointFeedbackPipe):
    """Writes received wrenches to contacts of the Robot.

    Positions of the contacts and rotations of their links are those of the Robot's State when the message is read.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        robot: The Robot.
        carried: Its contacts in the messages.
        required: Whether the plugin has to wait for this pipe before it starts.
        known: Other names that a message may contain; None: any.

    Attributes:
        frame: Frame of the axes.
        wrenches: The newest wrench of each contact as in the message, by its name, shape (6,); live. That of a message
            of one contact is `value`.
    """

    what = "contact"

    def __init__(
        self,
        name: str,
        reader: Reader,
        robot: Robot,
        carried: CarriedContacts,
        required: bool = True,
        *,
        known: Collection[str] | None = (),
    ):
        port = carried.port()
        super().__init__(name, reader, port, received=carried.format, required=required, known=known)
        rows = port.value.reshape(-1, 6)
        self._robots = _Wrenches(robot, carried, rows)
        self._brought = self._robots.all
        self.frame = carried.format.frame
        self.wrenches = dict(zip(carried.names or ("value",), rows, strict=True))

    def repeat(self, arrival: float) -> None:
        """See `FeedbackPipe.repeat`; writes them to the contacts."""
        super().repeat(arrival)
        self._robots.write(self._robots.all)

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        status = super().run()
        if status is NEW:
            self._robots.write(self._brought)
        return status

    def _copy_named(self, message: Message) -> None:
        super()._copy_named(message)
        target = self._names.order.target
        self._brought = self._robots.all if target is None else target


class ContactCommandPipe(PointCommandPipe):
    """Publishes the wrenches of contacts of the Robot; values that are NaN or infinite are not sent.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        robot: The Robot.
        carried: Its contacts in the messages.
    """

    def __init__(self, name: str, writer: Writer, robot: Robot, carried: CarriedContacts):
        port = carried.port()
        super().__init__(name, writer, port, published=carried.format)
        self._robots = _Wrenches(robot, carried, port.value.reshape(-1, 6))

    def collect(self) -> None:
        """See `CommandPipe.collect`."""
        self._robots.read()
        super().collect()
