"""Reaction forces of the ground at the contacts of a robot, from the efforts of its joints."""

from collections.abc import Iterable

from solfer.errors import PointError
from solfer.points.acceleration import Acceleration, LinearAcceleration, RollingAcceleration
from solfer.points.contact.constraint_force import ConstraintForce
from solfer.points.contact.contacts import Contact, PointContact, RollingContact


class ContactForces(ConstraintForce):
    """Forces of the ground on the robot that keep its contacts in place, or rolling without slip, world axes [N].

    A x + b with x the efforts of the DoFs, `robot.state.torque`; A, b: `ConstraintForce`. Forces at lifted contacts are
    zero. The ground may pull here, and hold more than friction allows. `update` updates no contact, and
    writes no `wrench`.

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
        super().__init__(_acceleration(contact) for contact in self.contacts)

    def update(self, jacobian: bool = True) -> None:
        """Compute the Jacobian if `jacobian`, the offset and the value, at the last update of the Robot."""
        for contact, acceleration in zip(self.contacts, self.accelerations, strict=True):
            acceleration.flags[:] = not contact.active
        super().update(jacobian)


def _acceleration(contact: Contact) -> Acceleration:
    """Return the acceleration that is zero while a contact holds."""
    acceleration: RollingAcceleration | LinearAcceleration
    if isinstance(contact, RollingContact):
        acceleration = RollingAcceleration(contact.link, contact.robot, ring=0.0, tube=0.0)
    elif isinstance(contact, PointContact):
        acceleration = LinearAcceleration(contact.link, contact.robot)
    else:
        raise PointError(f"no contact force at {contact}", expected="PointContacts or RollingContacts")
    # shares the memory of the contact's place
    acceleration._numbers = contact._numbers
    return acceleration
