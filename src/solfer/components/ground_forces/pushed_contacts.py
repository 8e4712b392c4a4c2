"""Contacts that the ground may push, with their forces and speeds along their normals."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.components.ground_forces import kernel
from solfer.interfaces.port import Port
from solfer.numerics.blocks import MemoryBlock
from solfer.numerics.pointers import address
from solfer.points.contact.support_vertex import UP
from solfer.robot import Robot
from solfer.robot.contacts import Contacts


class PushedContacts:
    """Contacts that the ground may push; each vector is in world axes.

    Args:
        names: Names of the contacts k.
        robot: Their Robot, with n DoFs.
        torque: Torques of its joints, shape (n,) [Nm, N]; live.
        bias_force: Where J^T f - h is written, shape (n,) [N, Nm].
        overall_force: Where this and the torques are written, shape (n,) [N, Nm].

    Attributes:
        names: See above.
        contacts: The contacts.
        normals: Normals of the ground, shape (k, 3).
        ports: Where the force of each is published.
        jacobian: Their Jacobians below each other, shape (3 k, n); live.
        forces: What the ground does to them, shape (k, 3) [N]; live.
        normal_forces: These along the normals, shape (k,) [N]; live.
        speeds: Speeds along the normals, shape (k,) [m/s]; live.
        sums: Sums of the forces that were published, shape (k, 3) [N]; live.
        write: write(forces) writes forces without torques to the contacts, shape (k, 3) [N].
        measure: measure() reads the force of each contact, and computes its speed.
        publish: publish(touching) takes the forces of contacts that do not touch away, shape (k,), and writes what
            follows from the others: ports, sums, and the two forces above.
    """

    def __init__(
        self,
        names: Sequence[str],
        robot: Robot,
        torque: np.ndarray,
        *,
        bias_force: np.ndarray,
        overall_force: np.ndarray,
    ):
        count = len(names)
        self.names = tuple(names)
        self.contacts = tuple(robot.contacts[name] for name in names)
        self.normals = np.array([getattr(contact, "normal", UP) for contact in self.contacts], dtype=float)
        self.ports = [Port("force") for _ in names]
        self.jacobian = np.zeros((3 * count, robot.size))
        self.forces, self.sums = np.zeros((2, count, 3))
        self.normal_forces, self.speeds = np.zeros((2, count))
        self._layout: np.ndarray | None = None
        self._arrays: list[np.ndarray] = []
        self._block = MemoryBlock(
            kernel.PUSHED,
            count=count,
            dofs=robot.size,
            sources=np.zeros(count, dtype=np.int64),
            wrenches=np.zeros(count, dtype=np.int64),
            ports=np.array([address(port.value) for port in self.ports]),
            normals=self.normals,
            velocity=robot.state.velocity,
            jacobian=self.jacobian,
            forces=self.forces,
            normal_forces=self.normal_forces,
            speeds=self.speeds,
            sums=self.sums,
            bias=robot.dynamics.bias,
            torque=torque,
            bias_force=bias_force,
            overall_force=overall_force,
        )
        start = self._block.address
        self.write = partial(kernel.push, start)
        self.measure = partial(kernel.measure, start)
        self.publish = partial(kernel.publish, start)

    def read_jacobians(self, contacts: Contacts) -> None:
        """Read the Jacobian of each contact, as of the last update of all contacts of the Robot."""
        if contacts.wrenches is not self._layout:  # contacts have come or gone, and arrays have moved
            self._layout = contacts.wrenches
            jacobians = [contact.jacobian for contact in self.contacts]
            wrenches = [contact.wrench for contact in self.contacts]
            self._arrays = [*jacobians, *wrenches]
            self._block.arrays["sources"][:] = [address(jacobian) for jacobian in jacobians]
            self._block.arrays["wrenches"][:] = [address(wrench) for wrench in wrenches]
        kernel.gather(self._block.address)
