"""The contacts that carry a robot: what they hold, and the forces that the ground can have there."""

import math
from collections.abc import Mapping

import numpy as np

from solfer.components.inverse_dynamics.cones import FrictionCones
from solfer.components.inverse_dynamics.tags import InverseDynamicsTags
from solfer.errors import ComponentError, SolferError
from solfer.points import Handler
from solfer.points.acceleration import Acceleration
from solfer.points.contact.contact_constraint import held_acceleration
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot


class Ground:
    """Contacts with unknown forces f along the rows that they hold.

    A contact that holds a point has three forces in world axes, another one a force along each row of its constraint,
    in its own frame with z along the normal. Forces keep G f <= 0: a pyramid of four sides within the friction cone,
    and for a flat foot the centre of pressure in its sole, and the torque about the normal. The normal forces N f lie
    between zero and `largest`, which grows and shrinks while contacts come and go. A robot on a fixed base needs none.

    Args:
        robot: The Robot.
        tags: Tags of the component.
        name: Name of the component, for messages.

    Attributes:
        contacts: The contacts by name.
        rows: What they hold: the Handler of their accelerations.
        jacobian: Its Jacobian Jc, shape (k, n); live.
        starts: First force of each contact, and the end of the last one, shape (c + 1,).
        cones: G and N.
        normals: N, shape (c, k); live.
        largest: Largest normal force of each contact, shape (c,) [N].
        fractions: How far each contact has come, from 0 for one that is lifted to 1, shape (c,).
        holds: Whether each row counts, shape (k,).
        unit: Force of the size that a contact has [N].
        fade: Time in which the force of a contact comes or goes [s]; may be set before each `update`.

    Raises:
        ComponentError: A base that floats has no contact, or a flat foot has no sole.
    """

    def __init__(self, robot: Robot, tags: InverseDynamicsTags, name: str = "inverse_dynamics"):
        self.contacts = _tracked(robot, tags)
        accelerations = [held_acceleration(contact) for contact in self.contacts.values()]
        self.rows: Handler[Acceleration] = Handler(accelerations)
        self.starts = np.cumsum([0, *(each.rows for each in accelerations)])
        count = len(accelerations)
        size = int(self.starts[-1])
        self.jacobian = self.rows.jacobian.reshape(size, robot.size)  # that of no point has no columns
        self.cones = FrictionCones(self.contacts, self.starts, tags, name)
        self.normals = self.cones.normals
        weight = float(robot.kinematics.mass * np.linalg.norm(robot.gravity))
        self.unit = weight / max(count, 1)
        self.fade = tags.fade
        self._placed = np.array([contact.active for contact in self.contacts.values()], dtype=float)
        self._goals, self.fractions = self._placed.copy(), self._placed.copy()
        self._spans = np.full(count, weight)
        self.largest = np.zeros(count)
        self.holds = np.zeros(size, dtype=bool)
        self._change()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(self.contacts)

    def lift(self, index: int, lifted: bool, force: np.ndarray) -> None:
        """Let a contact's force vanish, or come again, within the time `fade`.

        Args:
            index: Number of the contact.
            lifted: Whether it is lifted.
            force: The present forces, shape (k,); the normal one of the contact is where it begins [N].
        """
        self._placed[index] = 0.0 if lifted else 1.0
        if self._placed[index] == self._goals[index]:
            return
        self._goals[index] = self._placed[index]
        pressed = max(float(self.normals[index] @ force), 0.0)
        weight = self.unit * len(self.contacts)
        self._spans[index] = pressed if lifted else weight
        self.fractions[index] = 1.0 if lifted else min(pressed / weight, 1.0)

    def start(self) -> None:
        """Let all contacts have come where they are to be."""
        self._goals[:] = self.fractions[:] = self._placed
        self._change()
        self.cones.start()

    def leave_out(self, absent: np.ndarray) -> tuple[str, ...]:
        """Let contacts not count until they are put down, or until the next start; return their names.

        Args:
            absent: Which contacts touch nothing, shape (c,).
        """
        left_out = absent & (self._goals > 0.0)
        self._goals[left_out] = self.fractions[left_out] = 0.0
        self._change()
        return tuple(name for name, is_absent in zip(self.contacts, left_out, strict=True) if is_absent)

    def update(self, step: float) -> None:
        """Advance by `step` [s], and compute the rows at the state of the last update of the Robot."""
        if not np.array_equal(self.fractions, self._goals):
            largest = step / self.fade if self.fade > step else 1.0
            self.fractions += np.clip(self._goals - self.fractions, -largest, largest)
            self._change()
        self.cones.update(step)
        self.rows.update()

    def _change(self) -> None:
        """Write what follows from the fractions."""
        for index, contact in enumerate(self.contacts.values()):
            fraction = float(self.fractions[index])
            contact.active = fraction > 0.0
            self.largest[index] = math.inf if fraction == 1.0 else fraction * self._spans[index]
            self.holds[self.starts[index] : self.starts[index + 1]] = fraction > 0.0


def _tracked(robot: Robot, tags: InverseDynamicsTags) -> Mapping[str, Contact]:
    """Return the contacts of the group `track` by name."""
    contacts = robot.contacts
    try:
        tracked = contacts.group(tags.track)
    except SolferError as error:
        raise error.at(tags.where("track")) from None
    if not tracked and robot.kinematics.base is not None:
        raise ComponentError(
            f"no contact of '{tags.track}' carries '{robot.name}'",
            where=tags.where("track"),
            expected="a robot configuration with `contacts: {read: true}`, and a group of links with contacts",
        )
    return {name: contacts[name] for name in contacts.names if contacts[name] in tracked}
