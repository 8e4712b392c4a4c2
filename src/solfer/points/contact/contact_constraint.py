"""What a contact keeps a link from doing: rows of its motion in the contact's own frame."""

from typing import cast

import numpy as np

from solfer.errors import PointError
from solfer.model.view import RobotView
from solfer.points.acceleration import (
    Acceleration,
    AngularAcceleration,
    LinearAcceleration,
    RollingAcceleration,
    SpatialAcceleration,
)
from solfer.points.contact.contacts import Contact, PointContact, RollingContact
from solfer.points.handler import Handler
from solfer.points.space import vector

__all__ = ["ContactConstraint"]


class ContactConstraint(Acceleration):
    """Rate of change of the motions that a contact does not allow, in the contact's frame [m/s^2, rad/s^2].

    With the velocity v of the link's material at the contact, its angular velocity w, the rows C of the contact
    (`Contact.constraint`) and the rotation R from the contact's frame to the world (`Contact.rotation`): the Jacobian
    J maps to C (R^T v, R^T w), which is zero while the contact holds. The value is its derivative: A x + b with x the
    accelerations of the DoFs, A = J, and b = dJ/dt times the velocities of the DoFs, where R turns, too. All are zero
    while the contact is lifted.

    Args:
        contact: The contact, updated before this.

    Attributes:
        contact: The contact.

    Raises:
        PointError: It is neither a PointContact nor a RollingContact.
    """

    def __init__(self, contact: Contact):
        self._motion = Handler(_motion(contact))
        self.contact = contact
        self._rows = contact.constraint
        super().__init__(vector(len(self._rows)), _robot(contact))
        self._rotation = np.zeros((6, 6))
        self._held = np.zeros_like(self._rows)
        self._velocity, self._drift = np.zeros((2, 6))

    @property
    def force_map(self) -> np.ndarray:
        """Map from forces along the rows to force and torque on the link, world axes, shape (6, rows); live."""
        return self._held.T

    def update(self, jacobian: bool = True) -> None:
        """Compute the Jacobian if `jacobian`, the offset and the value, at the last update of the Robot."""
        self._motion.update()
        rotation = self.contact.rotation
        self._rotation[:3, :3] = self._rotation[3:, 3:] = rotation.T
        np.dot(self._rows, self._rotation, out=self._held)
        if not self.contact.active:
            self._held[:] = 0.0
        super().update(jacobian)

    def compute_jacobian(self) -> None:
        """Write the Jacobian."""
        np.dot(self._held, self._motion.jacobian, out=self._jacobian)

    def compute_offset(self) -> None:
        """Write the offset: seen from a frame that turns at s, a vector a changes by s x a less."""
        np.dot(self._motion.jacobian, self.robot.state.velocity, out=self._velocity)
        (vx, vy, vz), (wx, wy, wz) = self._velocity[:3], self._velocity[3:]
        sx, sy, sz = self.contact.spin(wx, wy, wz)
        self._drift[:] = self._motion.offset
        self._drift -= (
            sy * vz - sz * vy,
            sz * vx - sx * vz,
            sx * vy - sy * vx,
            sy * wz - sz * wy,
            sz * wx - sx * wz,
            sx * wy - sy * wx,
        )
        np.dot(self._held, self._drift, out=self.offset)

    def __str__(self) -> str:
        return f"{type(self).__name__} of '{self.contact.link}', {self.space}"


def held_acceleration(contact: Contact) -> Acceleration:
    """Return the acceleration that is zero while a contact holds.

    Where a contact constrains the forces along all three directions and no moment, its frame does not matter: then it
    is the acceleration in world axes.

    Raises:
        PointError: It is neither a PointContact nor a RollingContact.
    """
    if isinstance(contact, Contact) and not contact.holds_a_point:
        return ContactConstraint(contact)
    return _linear(contact)


def _motion(contact: Contact) -> tuple[Acceleration, ...]:
    """Return linear, then angular acceleration of the link's material at a contact, six rows together."""
    if not isinstance(contact, PointContact):
        return _linear(contact), AngularAcceleration(contact.link, _robot(contact))
    motion = SpatialAcceleration(contact.link, _robot(contact))
    motion.share_place(contact)
    return (motion,)


def _linear(contact: Contact) -> RollingAcceleration | LinearAcceleration:
    acceleration: RollingAcceleration | LinearAcceleration
    if isinstance(contact, RollingContact):
        acceleration = RollingAcceleration(contact.link, _robot(contact), ring=0.0, tube=0.0)
    elif isinstance(contact, PointContact):
        acceleration = LinearAcceleration(contact.link, _robot(contact))
    else:
        raise PointError(f"no contact force at {contact}", expected="PointContacts or RollingContacts")
    acceleration.share_place(contact)
    return acceleration


def _robot(contact: Contact) -> RobotView:
    return cast(RobotView, contact.robot)
