"""What the ground does to the robot, from the efforts of its joints: the paper's `ground_forces` (Fig. 5)."""

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.diagnostics import Statuses
from solfer.components.filter_tags import live_filter
from solfer.components.ground_forces.checks import ContactChecks
from solfer.components.ground_forces.laws import ProjectedLaw, WeightedLaw
from solfer.components.ground_forces.tags import GroundForcesTags
from solfer.components.ground_forces.touch import Touch
from solfer.dynamics import BIAS
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.declaration import LiveParameter, TopicOut
from solfer.interfaces.geometry import ForceAndTorque, Header, StampedWrench, Vector
from solfer.interfaces.port import Port
from solfer.model.contacts import read_contacts
from solfer.numerics.filters import LowPass
from solfer.points.contact.contacts import Contact, make_contact
from solfer.points.contact.support_vertex import UP
from solfer.robot import Robot

PUBLISHED = 50.0
"""Rate at which the wrench of each contact is published on a topic of its own, at most [Hz]."""

REPORTED = 1.0
"""Rate at which contacts are reported [Hz]."""


class GroundForces(Component):
    """Writes the forces of the ground into the contacts of its Robot, and publishes them.

    The method `projection` computes the forces that keep the contacts in place, or rolling, as the paper does
    (`ContactForces`). They may pull, and forces that the constraints do not allow for are forced upon them. The method
    `weighted` takes those that explain the torques best (`WeightedForces` of a `MomentumObserver`): a wheel in the air
    gets none, whatever its constraint, and what is left at the base is a push from outside.

    The State has two interfaces more: `bias_force`, J^T f - h, and `overall_force`, to which the torques are added: the
    inertia times the acceleration that follows from all of them [N, Nm].

    Points that it publishes: `center_of_pressure` [m], `external_wrench` (force and torque on the base about its
    origin, world axes, of the method `weighted` [N, Nm]), and for each contact its force, world axes [N], by the name
    of the contact behind the `prefix`.

    Args:
        robot: The Robot, with contacts.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        law: The method.
        touch: Which contacts touch; None without the tag `touch`.
        checks: Reports forces that the ground cannot have.

    Raises:
        ComponentError: No contact is left to push.
    """

    Tags = GroundForcesTags

    def __init__(self, robot: Robot, tags: GroundForcesTags | None = None, name: str = "ground_forces"):
        super().__init__(robot, tags or GroundForcesTags(), name)
        self.dynamics = True
        tags = self.tags
        self._names = self._tracked()
        self._contacts = [robot.contacts[name] for name in self._names]
        self._torque = np.zeros(robot.size)
        self._normals = np.array([getattr(contact, "normal", UP) for contact in self._contacts])
        count = len(self._contacts)
        self._jacobian, (self._normal_forces, self._speeds) = np.zeros((3 * count, robot.size)), np.zeros((2, count))
        self._forces, self._velocities, self._along = np.zeros((3, count, 3))
        self._bias_force, self._overall_force = (
            robot.state.add(f"{tags.prefix}{each}") for each in ("bias_force", "overall_force")
        )
        self._none = np.zeros(len(self._contacts), dtype=bool)
        self._touching = np.ones(len(self._contacts))
        self.law = self._make_law()
        self._filter: LowPass | None = None
        self._cycles = 0
        self._silence = 1
        self._between = 1
        self.checks = ContactChecks(self._names, self._normals, tags.friction)
        self.touch = None if tags.touch is None else Touch(len(self._contacts), **dict(tags.touch))
        self.outputs["center_of_pressure"] = Port("position")
        self.outputs["external_wrench"] = Port("wrench")
        self._ports = [Port("force") for _ in self._contacts]
        self.outputs |= {f"{tags.prefix}{each}": port for each, port in zip(self._names, self._ports, strict=True)}

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer the filter of torques, when contacts touch, and the friction beyond which forces are reported."""
        size = self.model.size
        rate = 1.0 / self.period
        touch = () if self.touch is None else ("above", "below", "speed", "delay")
        return (
            *live_filter(("filter", "torque"), self._filter, lambda tags: tags.filter.torque.low_pass(size, rate)),
            *(LiveParameter(("touch", key), self._take_touch) for key in touch),
            LiveParameter(("friction",), self._take_friction),
        )

    def _take_touch(self, tags: GroundForcesTags) -> None:
        assert self.touch is not None
        self.touch.set(**dict(tags.touch or ()))

    def _take_friction(self, tags: GroundForcesTags) -> None:
        self.checks.friction = tags.friction

    def topics(self) -> tuple[TopicOut, ...]:
        """Publish `<name>/<contact>`: what the ground does to the contact's link, about its origin and in its axes.

        On `/diagnostics` the node reports once a second what contacts do, and which forces the ground cannot have.
        """
        interface = "geometry_msgs/WrenchStamped"
        return (
            *(
                TopicOut(each, interface, StampedWrench, collect=functools.partial(self._wrench_now_and_then, contact))
                for each, contact in zip(self._names, self._contacts, strict=True)
            ),
            TopicOut("/diagnostics", "diagnostic_msgs/DiagnosticArray", Statuses, collect=self._report_now_and_then),
        )

    def start_log(self, logger: Any) -> None:
        """Declare force, normal force and touch of each contact, the push on the base, and the torques as used."""
        names = self._names
        logger.add("forces", self._forces, [f"{name}.{axis}" for name in names for axis in "xyz"], "N", "world")
        logger.add("normal_forces", self._normal_forces, names, "N")
        logger.add("touching", self._touching, names)
        logger.add("external_wrench", self.law.push, ("fx", "fy", "fz", "tx", "ty", "tz"), ("N",) * 3 + ("Nm",) * 3)
        logger.add("torque", self._torque, self.model.dofs)

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: which contacts touch."""
        if self.touch is not None:
            self._touching[:] = self.touch.touching

    def _wrench_now_and_then(self, contact: Contact) -> StampedWrench | None:
        return None if self._cycles % self._silence else wrench_on_link(contact, self.model)

    def _report_now_and_then(self) -> Statuses | None:
        return self.checks.report(self.name) if self._cycles % self._between == 1 else None

    def _make_law(self) -> ProjectedLaw | WeightedLaw:
        robot = self.model
        tags = self.tags
        robot.dynamics.subscribe(BIAS)
        if tags.method == "projection":
            return ProjectedLaw(self._contacts, self._torque)
        return WeightedLaw(robot, self._contacts, self._torque, tags=tags)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts that the ground may push."""
        return tuple(self._contacts)

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return self._names

    @property
    def torque(self) -> np.ndarray:
        """Torques of the joints as they are used, filtered, shape (n,) [Nm, N]; live."""
        return self._torque

    def _tracked(self) -> tuple[str, ...]:
        """Return the names of the contacts that count."""
        contacts = self.model.contacts
        tags = self.tags
        try:
            group = contacts.group(tags.track)
        except UnknownName as error:
            raise error.at(tags.where("track")) from None
        names: Iterable[str] = [each for each in contacts.names if contacts[each] in group]
        if tags.contact_source is not None:
            names = [
                each
                for each in self._listed(tags.contact_source.location)
                if contacts[each] in contacts.group(tags.track)
            ]
        if not names:
            raise ComponentError(
                f"the ground pushes no contact of '{self.model.name}'",
                where=tags.where("track"),
                expected="a robot configuration with `contacts: {read: true}`, and a group of links with contacts",
            )
        return tuple(names)

    def _listed(self, file: Path) -> tuple[str, ...]:
        """Return the names of the contacts in a file, on links that the Robot has; those that it lacks are added."""
        contacts = self.model.contacts
        links = self.model.links("all")
        records = [each for each in read_contacts(file, self.model.name) if each.end_frame in links]
        for record in records:
            if record.name not in contacts.names:
                contacts.add(make_contact(record, self.model), record.name)
        return tuple(record.name for record in records)

    def set_rate(self, rate: float) -> None:
        """See `Component.set_rate`.

        Raises:
            ConfigError: The filter's cut-off is not below half of the rate.
        """
        super().set_rate(rate)
        tags = self.tags.filter.torque
        self._filter = None if tags is None else tags.low_pass(self.model.size, rate)
        self._silence = max(1, round(rate / PUBLISHED))
        self._between = max(2, round(rate / REPORTED))

    def init(self) -> None:
        """Begin with the torques of now, unfiltered, and with the contacts that touch now."""
        self._torque[:] = self.model.state.torque
        if self._filter is not None:
            self._filter.reset()
        self._cycles = 0
        self.checks.start()
        self.law.start(self.period)
        self._compute()
        if self.touch is not None:
            self.touch.start(self._normal_forces)
        self._finish()

    def update(self) -> None:
        """Compute the forces of this cycle."""
        self._cycles += 1
        self._torque[:] = self.model.state.torque
        if self._filter is not None:
            self._filter.step(self._torque)
        self._compute()
        if self.touch is not None:
            self.touch.update(self._normal_forces, self._speeds, self.passed)
        self._finish()

    def reset(self) -> None:
        """Forget the forces."""
        for contact in self._contacts:
            contact.wrench[:] = 0.0

    def _compute(self) -> None:
        """Write what the law computes into the contacts, and note their normal forces and speeds."""
        self.model.contacts  # noqa: B018 they are updated where they are requested
        for index, contact in enumerate(self._contacts):
            self._jacobian[3 * index : 3 * index + 3] = contact.jacobian
        self.law.update(self._jacobian, self._none if self.touch is None else self.touch.lifted, self.passed)
        for index, contact in enumerate(self._contacts):
            self._forces[index] = contact.wrench[:3]
        np.multiply(self._forces, self._normals, out=self._along)
        np.sum(self._along, axis=1, out=self._normal_forces)
        np.dot(self._jacobian, self.model.state.velocity, out=self._velocities.reshape(-1))
        np.multiply(self._velocities, self._normals, out=self._along)
        np.sum(self._along, axis=1, out=self._speeds)

    def _finish(self) -> None:
        """Take the forces of contacts that do not touch away, and publish what follows from them."""
        for index, contact in enumerate(self._contacts):
            if self.touch is not None and not self.touch.touching[index]:
                contact.wrench[:] = self._forces[index] = 0.0
            self._ports[index].value[:] = self._forces[index]
        self.checks.add(self._forces)
        np.dot(self._forces.reshape(-1), self._jacobian, out=self._bias_force)
        self._bias_force -= self.model.dynamics.bias
        np.add(self._bias_force, self._torque, out=self._overall_force)
        self.outputs["center_of_pressure"].value[:] = self.model.center_of_pressure.value
        self.outputs["external_wrench"].value[:] = self.law.push


def wrench_on_link(contact: Contact, robot: Robot) -> StampedWrench:
    """Make the message of a contact's wrench: in the axes of its link, about the link's origin, as a sensor there."""
    rotation = robot.kinematics.rotation(contact.link)
    arm = contact.value - robot.kinematics.position(contact.link)
    force = contact.wrench[:3]
    torque = contact.wrench[3:] + np.cross(arm, contact.wrench[:3])
    wrench = ForceAndTorque(*(Vector(*(vector @ rotation).tolist()) for vector in (force, torque)))
    return StampedWrench(Header(frame_id=contact.link), wrench)
