"""Contacts that the ground may push, with their forces and speeds along their normals."""

from collections.abc import Sequence

import numpy as np

from solfer.interfaces.port import Port
from solfer.points.contact.contacts import Contact
from solfer.points.contact.support_vertex import UP


class PushedContacts:
    """Contacts that the ground may push; each vector is in world axes.

    Args:
        names: Names of the contacts k.
        contacts: The contacts.
        size: Number n of DoFs of their Robot.

    Attributes:
        names: See above.
        contacts: See above.
        normals: Normals of the ground, shape (k, 3).
        ports: Where the force of each is published.
        jacobian: Their Jacobians below each other, shape (3 k, n); live.
        forces: What the ground does to them, shape (k, 3) [N]; live.
        normal_forces: These along the normals, shape (k,) [N]; live.
        speeds: Speeds along the normals, shape (k,) [m/s]; live.
    """

    def __init__(self, names: Sequence[str], contacts: Sequence[Contact], size: int):
        count = len(contacts)
        self.names = tuple(names)
        self.contacts = tuple(contacts)
        self.normals = np.array([getattr(contact, "normal", UP) for contact in contacts])
        self.ports = [Port("force") for _ in contacts]
        self.jacobian = np.zeros((3 * count, size))
        self.forces, self._velocities, self._along = np.zeros((3, count, 3))
        self.normal_forces, self.speeds = np.zeros((2, count))

    def read_jacobians(self) -> None:
        """Read the Jacobian of each contact."""
        for index, contact in enumerate(self.contacts):
            self.jacobian[3 * index : 3 * index + 3] = contact.jacobian

    def read_forces(self, velocity: np.ndarray) -> None:
        """Read the force of each contact, and compute its speed by the velocities of the DoFs, shape (n,) [rad/s]."""
        for index, contact in enumerate(self.contacts):
            self.forces[index] = contact.wrench[:3]
        np.multiply(self.forces, self.normals, out=self._along)
        np.sum(self._along, axis=1, out=self.normal_forces)
        np.dot(self.jacobian, velocity, out=self._velocities.reshape(-1))
        np.multiply(self._velocities, self.normals, out=self._along)
        np.sum(self._along, axis=1, out=self.speeds)
