"""What the ground does to the robot, from the efforts of its joints: the paper's `ground_forces` (Fig. 5)."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.diagnostics import Statuses
from solfer.components.filter_tags import live_filter
from solfer.components.ground_forces.checks import ContactChecks
from solfer.components.ground_forces.laws import ProjectedLaw, WeightedLaw
from solfer.components.ground_forces.pushed_contacts import PushedContacts
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
from solfer.robot import Robot


class GroundForces(Component):
    """Writes the forces of the ground into the contacts of its Robot, and publishes them.

    The method `projection` computes the forces that keep the contacts in place, or rolling, as the paper does
    (`ContactForces`). They may pull, and forces that the constraints do not allow for are forced upon them. The method
    `weighted` takes those that explain the torques best (`WeightedForces`): a wheel in the air
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
        names = self._tracked()
        count = len(names)
        self._torque = np.zeros(robot.size)
        robot.dynamics.subscribe(BIAS)
        self._pushed = PushedContacts(
            names,
            robot,
            self._torque,
            bias_force=robot.state.add(f"{tags.prefix}bias_force"),
            overall_force=robot.state.add(f"{tags.prefix}overall_force"),
        )
        self._none = np.zeros(count, dtype=bool)
        self._touching = np.ones(count)
        self.law = self._make_law()
        self._filter: LowPass | None = None
        weight = None if robot.kinematics.base is None else robot.kinematics.mass * robot.gravity
        pushed = self._pushed
        self.checks = ContactChecks(names, pushed.normals, pushed.sums, friction=tags.friction, weight=weight)
        self.touch = None if tags.touch is None else Touch(count, **dict(tags.touch))
        self._pushes = np.ones(count, dtype=bool) if self.touch is None else self.touch.touching
        self.outputs["center_of_pressure"] = Port("position")
        self.outputs["external_wrench"] = Port("wrench")
        self.outputs |= {f"{tags.prefix}{each}": port for each, port in zip(names, self._pushed.ports, strict=True)}

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
                TopicOut(name, interface, StampedWrench, partial(wrench_on_link, contact, self.model), rate=50.0)
                for name, contact in zip(self._pushed.names, self._pushed.contacts, strict=True)
            ),
            TopicOut("/diagnostics", "diagnostic_msgs/DiagnosticArray", Statuses, self._report, rate=1.0),
        )

    def start_log(self, logger: Any) -> None:
        """Declare force, normal force and touch of each contact, the push on the base, and the torques as used."""
        names = self._pushed.names
        logger.add("forces", self._pushed.forces, [f"{name}.{axis}" for name in names for axis in "xyz"], "N", "world")
        logger.add("normal_forces", self._pushed.normal_forces, names, "N")
        logger.add("touching", self._touching, names)
        logger.add("external_wrench", self.law.push, ("fx", "fy", "fz", "tx", "ty", "tz"), ("N",) * 3 + ("Nm",) * 3)
        logger.add("torque", self._torque, self.model.dofs)

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: which contacts touch."""
        if self.touch is not None:
            self._touching[:] = self.touch.touching

    def _report(self) -> Statuses:
        return self.checks.report(self.name)

    def _make_law(self) -> ProjectedLaw | WeightedLaw:
        robot = self.model
        tags = self.tags
        if tags.method == "projection":
            return ProjectedLaw(self._pushed.contacts, self._torque)
        return WeightedLaw(robot, self._pushed, self._torque, tags=tags)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts that the ground may push."""
        return self._pushed.contacts

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return self._pushed.names

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

    def init(self) -> None:
        """Begin with the torques of now, unfiltered, and with the contacts that touch now."""
        self._torque[:] = self.model.state.torque
        if self._filter is not None:
            self._filter.reset()
        self.law.start(self.period)
        self._compute()
        if self.touch is not None:
            self.touch.start(self._pushed.normal_forces)
        self._finish()
        self.checks.start()

    def update(self) -> None:
        """Compute the forces of this cycle."""
        self._torque[:] = self.model.state.torque
        if self._filter is not None:
            self._filter.step(self._torque)
        self._compute()
        if self.touch is not None:
            self.touch.update(self._pushed.normal_forces, self._pushed.speeds, self.passed)
        self._finish()

    def reset(self) -> None:
        """Forget the forces."""
        for contact in self._pushed.contacts:
            contact.wrench[:] = 0.0

    def _compute(self) -> None:
        """Write what the law computes into the contacts, and note their normal forces and speeds."""
        pushed = self._pushed
        pushed.read_jacobians(self.model.contacts)
        self.law.update(pushed.jacobian, self._none if self.touch is None else self.touch.lifted, self.passed)
        pushed.measure()

    def _finish(self) -> None:
        """Take the forces of contacts that do not touch away, and publish what follows from them."""
        self.model.dynamics.manager.use(BIAS)
        self._pushed.publish(self._pushes)
        self.checks.count += 1
        self.outputs["center_of_pressure"].value[:] = self.model.center_of_pressure.value
        self.outputs["external_wrench"].value[:] = self.law.push


def wrench_on_link(contact: Contact, robot: Robot) -> StampedWrench:
    """Make the message of a contact's wrench: in the axes of its link, about the link's origin, as a sensor there."""
    rotation = robot.kinematics.rotation(contact.link)
    x, y, z = (contact.value - robot.kinematics.position(contact.link)).tolist()
    fx, fy, fz, tx, ty, tz = contact.wrench.tolist()
    torque = (tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx)
    force, torque = (np.array(((fx, fy, fz), torque)) @ rotation).tolist()
    return StampedWrench(Header(frame_id=contact.link), ForceAndTorque(Vector(*force), Vector(*torque)))
