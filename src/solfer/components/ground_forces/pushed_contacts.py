"""Contacts that the ground may push, with their forces and speeds along their normals."""

from collections.abc import Sequence

import numpy as np

from solfer.components.ground_forces import kernel
from solfer.interfaces.port import Port
from solfer.points.contact.contacts import Contact
from solfer.points.contact.support_vertex import UP
from solfer.robot.contacts import Contacts


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
        self.normals = np.array([getattr(contact, "normal", UP) for contact in contacts], dtype=float)
        self.ports = [Port("force") for _ in contacts]
        self.jacobian = np.zeros((3 * count, size))
        self.forces = np.zeros((count, 3))
        self.normal_forces, self.speeds = np.zeros((2, count))
        self._layout: np.ndarray | None = None
        self._jacobians: list[np.ndarray] = []
        self._wrenches: list[np.ndarray] = []

    def read_jacobians(self, contacts: Contacts) -> None:
        """Read the Jacobian of each contact, as of the last update of all contacts of the Robot."""
        if contacts.wrenches is not self._layout:  # contacts have come or gone, and arrays have moved
            self._layout = contacts.wrenches
            self._jacobians = [contact.jacobian for contact in self.contacts]
            self._wrenches = [contact.wrench for contact in self.contacts]
        row = 0
        for jacobian in self._jacobians:
            self.jacobian[row : row + 3] = jacobian
            row += 3

    def write_forces(self, forces: np.ndarray) -> None:
        """Write forces without torques to the contacts, shape (k, 3) [N]."""
        for wrench, force in zip(self._wrenches, forces, strict=True):
            wrench[:3] = force
            wrench[3:] = 0.0

    def read_forces(self, velocity: np.ndarray) -> None:
        """Read the force of each contact, and compute its speed by the velocities of the DoFs, shape (n,) [rad/s]."""
        for index, wrench in enumerate(self._wrenches):
            self.forces[index] = wrench[:3]
        kernel.measure(self.jacobian, velocity, self.normals, self.forces, self.normal_forces, self.speeds)
