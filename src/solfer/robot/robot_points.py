"""Points that every Robot has (section 1.1.2 of the paper): centre of mass, contacts, centre of pressure."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from solfer.errors import UnknownName, raise_all
from solfer.model.contacts import ContactRecord

if TYPE_CHECKING:
    from solfer.points import CenterOfMass, CenterOfPressure, Point
    from solfer.robot.contacts import Contacts, GroupedRobot


class RobotPoints:
    """Points that are made at their first use, and computed at their first use after an update.

    Args:
        robot: The Robot.
        contacts: Its contacts.

    Attributes:
        updates: Number of the Robot's newest update; who updates it counts.
        computed: How often each of them was computed, by its name.

    Raises:
        UnknownName: The robot has no such link.
        SolferErrors: Several of these.
    """

    def __init__(self, robot: "GroupedRobot", contacts: Iterable[ContactRecord] = ()):
        self._robot = robot
        self._records = tuple(contacts)
        links = robot.kinematics.description.links
        raise_all(
            [
                UnknownName("link", record.end_frame, links, where=record.where("end_frame"))
                for record in self._records
                if record.end_frame not in links
            ]
        )
        self._center_of_mass: CenterOfMass | None = None
        self._contacts: Contacts | None = None
        self._center_of_pressure: CenterOfPressure | None = None
        self.updates = 0
        self._center_update = self._contacts_update = -1
        self.computed = dict.fromkeys(("center_of_mass", "contacts", "center_of_pressure"), 0)

    @property
    def center_of_mass(self) -> "CenterOfMass":
        """Centre of mass at the Robot's newest update."""
        if self._center_of_mass is None:
            # the compiled kernel behind points takes a while to load
            from solfer.points import CenterOfMass

            self._center_of_mass = CenterOfMass(self._robot)
        if self._center_update != self.updates:
            self.compute("center_of_mass", self._center_of_mass)
            self._center_update = self.updates
        return self._center_of_mass

    @property
    def contacts(self) -> "Contacts":
        """Contacts at the Robot's newest update."""
        if self._contacts is None:
            from solfer.robot.contacts import Contacts

            self._contacts = Contacts(self._robot, self._records)
        if self._contacts_update != self.updates:
            self.compute("contacts", self._contacts)
            self._contacts_update = self.updates
        return self._contacts

    @property
    def center_of_pressure(self) -> "CenterOfPressure":
        """Centre of pressure at the Robot's newest update, for the contacts' present forces."""
        contacts = self.contacts
        if self._center_of_pressure is None:
            from solfer.points import CenterOfPressure

            self._center_of_pressure = CenterOfPressure(contacts)
        self.compute("center_of_pressure", self._center_of_pressure)
        return self._center_of_pressure

    def compute(self, name: str, point: "Point | Contacts") -> None:
        """Compute one of the points, and count it under its `name`."""
        point.update()
        self.computed[name] += 1
