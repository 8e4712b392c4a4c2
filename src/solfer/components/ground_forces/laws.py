"""The two laws of the component `ground_forces`: torques in, wrenches of contacts out."""

from collections.abc import Sequence

import numpy as np

from solfer.components.ground_forces.offsets import TorqueOffsets
from solfer.components.ground_forces.pushed_contacts import PushedContacts
from solfer.components.ground_forces.tags import GroundForcesTags
from solfer.components.ground_forces.weighted_forces import WeightedForces
from solfer.points.contact.contact_forces import ContactForces
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot


class ForcesOfTorques(ContactForces):
    """Forces that keep contacts in place by torques that are not those of the State, but derived from them.

    Args:
        contacts: See `ContactForces`.
        torque: The torques, shape (n,) [Nm, N]; live.
    """

    def __init__(self, contacts: Sequence[Contact], torque: np.ndarray):
        self._torque = torque
        super().__init__(contacts)

    @property
    def x(self) -> np.ndarray:
        """The torques, shape (n,) [Nm, N]; live."""
        return self._torque


class ProjectedLaw:
    """The forces that keep contacts in place, or rolling.

    Args:
        contacts: The contacts.
        torque: Torques of the joints, shape (n,) [Nm, N]; live.
    """

    def __init__(self, contacts: Sequence[Contact], torque: np.ndarray):
        self._forces = ForcesOfTorques(contacts, torque)
        self.push = np.zeros(6)
        """What pushes the base besides the ground: not known, zero, shape (6,)."""

    def start(self, period: float) -> None:
        """Begin; there is nothing to remember."""

    def update(self, jacobian: np.ndarray, lifted: np.ndarray, passed: float) -> None:
        """Write the wrenches of the contacts; their constraints alone count, whether they are `lifted` or not."""
        self._forces.update(jacobian=False)
        self._forces.write_wrenches()


class WeightedLaw:
    """The forces that explain torques and momentum best.

    Args:
        robot: The Robot.
        pushed: Contacts of it.
        torque: Torques of the joints, shape (n,) [Nm, N]; live.
        tags: Tags of the component.

    Attributes:
        push: What pushes the base besides the ground: force, then torque about the base's origin, world axes, shape
            (6,) [N, Nm]; live.
        offsets: Those of the torque sensors; None: they have none.
    """

    def __init__(self, robot: Robot, pushed: PushedContacts, torque: np.ndarray, tags: GroundForcesTags):
        contacts = pushed.contacts
        self._pushed = pushed
        floating = robot.kinematics.base is not None
        deviations = np.full(robot.size, tags.torque_deviation)
        if floating:
            deviations[:6] = tags.push_deviation
        self.offsets = None
        self._largest = 0.0
        if tags.offsets is not None:
            self.offsets = TorqueOffsets(contacts, deviations, tags.offsets, base=floating)
            self._largest = tags.offsets.largest_push
        self._forces = WeightedForces(
            robot,
            contacts,
            deviations,
            cut_off=tags.observer,
            jacobian=pushed.jacobian,
            torque=torque,
            offsets=np.zeros(robot.size) if self.offsets is None else self.offsets.value,
        )
        self.push = self._forces.push

    def start(self, period: float) -> None:
        """Begin, not accelerated, with cycles of `period` [s]; known offsets stay."""
        self._forces.start()
        if self.offsets is not None:
            self.offsets.start(period)

    def update(self, jacobian: np.ndarray, lifted: np.ndarray, passed: float) -> None:
        """Write the wrenches of the contacts.

        Args:
            jacobian: Of the contacts, shape (3k, n).
            lifted: Which contacts are in the air for sure, shape (k,).
            passed: Time since the last cycle [s].
        """
        forces = self._forces
        forces.update(passed)
        self._pushed.write(forces.value)
        if self.offsets is not None:
            x, y, z = self.push[:3].tolist()
            self.offsets.update(jacobian, forces.world, lifted, x * x + y * y + z * z > self._largest**2)
