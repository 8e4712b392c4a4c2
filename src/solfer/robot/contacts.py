"""The contacts of a Robot by name, with the forces of the ground on them."""

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from solfer.errors import PointError, UnknownName
from solfer.model.contacts import ContactRecord
from solfer.model.view import RobotView
from solfer.points import Handler, make_contact
from solfer.points.contact.contact_constraint import ContactConstraint
from solfer.points.contact.contacts import Contact


class GroupedRobot(RobotView, Protocol):
    """A Robot as its contacts see it: with the links of its groups."""

    def links(self, group: str) -> tuple[str, ...]:
        """Return the links of a group, or all links for `all`; an UnknownName if there is no such group."""


class Contacts(Handler[Contact]):
    """A Handler of contacts that also knows their names, their groups and the reaction forces.

    `value` contains their positions, `jacobian` the Jacobians of these places, with zeros for those that are lifted;
    what they constrain are `constraints`.

    Args:
        robot: The Robot.
        records: Its contacts.

    Attributes:
        wrenches: Forces, then torques of the ground on the robot at the contacts in world axes, shape (k, 6) [N, Nm].
            Live until contacts come or go, and the same memory as each contact's `wrench`: their source, a measurement
            or an estimate, writes them.

    Raises:
        PointError: Two have one name, or a wheel lacks its radii.
    """

    def __init__(self, robot: GroupedRobot, records: Iterable[ContactRecord] = ()):
        super().__init__()
        self._robot = robot
        self._names: list[str] = []
        self.wrenches = np.zeros((0, 6))
        self._constraints: Handler[ContactConstraint] | None = None
        for record in records:
            self.add(make_contact(record, robot), record.name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(self._names)

    @property
    def positions(self) -> np.ndarray:
        """Positions in the world as of the last update, shape (k, 3) [m]; live until contacts come or go."""
        return self.value.reshape(-1, 3)

    @property
    def forces(self) -> np.ndarray:
        """Reaction forces of the ground in world axes, shape (k, 3) [N]; the first half of `wrenches`."""
        return self.wrenches[:, :3]

    @property
    def constraints(self) -> Handler[ContactConstraint]:
        """What the contacts keep the robot from doing, in their order, as of the last update.

        The rows of `constraints.jacobian` are those that the contacts' file names, in the frame of each contact: three
        of a point, one where nothing rubs, six of a flat foot. They are zero for a contact that is lifted.
        """
        if self._constraints is None:
            self._constraints = Handler(ContactConstraint(contact) for contact in self)
            self._constraints.update()
        return self._constraints

    def update(self, jacobian: bool = True) -> None:
        """See `Handler.update`; once they were requested, the constraints are updated, too."""
        super().update(jacobian)
        if self._constraints is not None:
            self._constraints.update(jacobian)

    def add(self, point: Contact, name: str = "") -> Contact:
        """Append a contact, bring it up to date, and return it.

        Args:
            point: The contact.
            name: Its name (default: that of its link).

        Raises:
            PointError: It is not a contact, belongs to another Robot, or the name is in use.
        """
        if not isinstance(point, Contact):
            raise PointError(f"{point} is not a contact", expected="a PointContact or a RollingContact")
        if point.robot.kinematics is not self._robot.kinematics:
            raise PointError(
                f"{point} belongs to another Robot ('{point.robot.name}')", expected="one made on this Robot"
            )
        name = name or point.link
        if name in self._names:
            raise PointError(f"there is a contact '{name}' already", expected="another name")
        super().add(point)
        self._names.append(name)
        self._share_wrenches()
        self._constraints = None
        point.update()
        return point

    def remove(self, which: int | str | Contact) -> Contact:
        """Remove a contact, given by its name, its index or itself, and return it; it keeps its wrench.

        Raises:
            UnknownName: There is no contact of that name.
            PointError: There is no such contact.
        """
        contact = which if isinstance(which, Contact) else self[which]
        index = self._index(contact)
        super().remove(index)
        del self._names[index]
        contact.move_wrench(np.empty(6))
        self._share_wrenches()
        self._constraints = None
        return contact

    def __getitem__(self, which: int | str) -> Contact:
        if not isinstance(which, str):
            return super().__getitem__(which)
        if which not in self._names:
            raise UnknownName("contact", which, self._names)
        return super().__getitem__(self._names.index(which))

    def group(self, name: str) -> tuple[Contact, ...]:
        """Return the contacts on the links of a group of the SRDF, or all of them for `all`.

        Raises:
            UnknownName: There is no such group.
        """
        links = set(self._robot.links(name))
        return tuple(contact for contact in self if contact.link in links)

    def activate(self, group: str = "all", active: bool = True) -> None:
        """Let the contacts of a group touch the ground, or lift them; see `Contact.active`.

        Raises:
            UnknownName: There is no such group.
        """
        for contact in self.group(group):
            contact.active = active

    def _share_wrenches(self) -> None:
        """Make one array for the wrenches of all contacts."""
        self.wrenches = np.empty((len(self), 6))
        for contact, wrench in zip(self, self.wrenches, strict=True):
            contact.move_wrench(wrench)
