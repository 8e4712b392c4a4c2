"""Reaction forces of the ground at the contacts of a robot, from the efforts of its joints."""

from collections.abc import Iterable, Iterator

import numpy as np

from solfer.points.contact.constraint_force import ConstraintForce
from solfer.points.contact.contact_constraint import ContactConstraint, held_acceleration
from solfer.points.contact.contacts import Contact

__all__ = ["ContactForces"]


class ContactForces(ConstraintForce):
    """Forces of the ground on the robot that keep its contacts in place, or rolling without slip, world axes [N, Nm].

    A x + b with x the efforts of the DoFs, `robot.state.torque`; A, b: `ConstraintForce`. A contact has three numbers,
    the force; one that constrains a moment has six, force and torque about the contact. What a contact does not
    constrain (`Contact.constraint`) gets no force, and forces at lifted contacts are zero. The ground may pull here,
    and hold more than friction allows. `update` updates no contact.

    Args:
        contacts: PointContacts and RollingContacts of one Robot; forces have their order. Their places, and whether
            they touch the ground, may change.

    Attributes:
        contacts: The contacts.

    Raises:
        PointError: There is no contact, or they are of different Robots.
    """

    def __init__(self, contacts: Iterable[Contact]):
        self.contacts = tuple(contacts)
        held = [held_acceleration(contact) for contact in self.contacts]
        sizes = [6 if contact.constraint[:, 3:].any() else 3 for contact in self.contacts]
        super().__init__(held, sum(sizes))
        rows = self.accelerations.rows
        self._spread = np.zeros((self.size, rows))
        self._gain = np.zeros((self.size, rows))
        self._rotated = list(self._blocks(sizes))
        first = np.concatenate(([0], np.cumsum(sizes)))
        self._wrenches = [slice(start, start + size) for start, size in zip(first, sizes, strict=False)]

    def update(self, jacobian: bool = True) -> None:
        """Compute the Jacobian if `jacobian`, the offset and the value, at the last update of the Robot."""
        for contact, acceleration in zip(self.contacts, self.accelerations, strict=True):
            acceleration.flags[:] = not contact.active
        super().update(jacobian)

    def write_wrenches(self) -> None:
        """Make the forces the wrenches of the contacts; torques that nothing constrains become zero."""
        for contact, numbers in zip(self.contacts, self._wrenches, strict=True):
            contact.wrench[3:] = 0.0
            contact.wrench[: numbers.stop - numbers.start] = self._value[numbers]

    def _blocks(self, sizes: list[int]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Write what does not change of the map from constrained rows to forces; yield the rest with its source."""
        first = row = 0
        for size, acceleration in zip(sizes, self.accelerations, strict=True):
            block = self._spread[first : first + size, row : row + acceleration.rows]
            if isinstance(acceleration, ContactConstraint):
                yield block, acceleration.force_map[:size]
            else:
                np.fill_diagonal(block, 1.0)
            first = first + size
            row = row + acceleration.rows

    def _spread_forces(self) -> np.ndarray:
        """See `ConstraintForce._spread_forces`: rows in frames of contacts are turned into world axes."""
        if not self._rotated:
            return super()._spread_forces()
        for block, force_map in self._rotated:
            block[:] = force_map
        return np.dot(self._spread, self._inertia.value, out=self._gain)
