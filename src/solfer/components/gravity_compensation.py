"""Torques that carry a robot on its contacts, and what others request of its parts (Figs. 3 to 5 of the paper)."""

import logging
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from solfer.components.base import Component
from solfer.components.desired_positions import DesiredPositions
from solfer.components.gains import GainsOfGroup, configured_gains, live_gains
from solfer.config import LIVE, NameOf, Record
from solfer.config.records.bounds import DURATION
from solfer.dynamics import BIAS, CarryingTorques
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.declaration import LiveParameter, Service
from solfer.interfaces.support import LiftContacts, LiftReply
from solfer.points import Handler, Point
from solfer.points.contact.contact_constraint import ContactConstraint
from solfer.robot import Robot

logger = logging.getLogger(__name__)


class GravityTags(Record):
    """Tags of `GravityCompensation`."""

    track: Annotated[str, NameOf("group")] = Field(
        "all", description="SRDF group of the links whose contacts carry the robot"
    )
    free: Annotated[str | None, NameOf("group")] = Field(
        None, description="SRDF group of joints that carry nothing, as wheels whose drives take speeds alone"
    )
    gains: tuple[GainsOfGroup, ...] = Field(
        (), description="stiffness and damping of groups of joints; a later group counts where two have a joint"
    )
    fade: float = Field(
        0.5, **DURATION, **LIVE, description="time in which torques change when a contact is lifted [s]"
    )


class GravityCompensation(Component):
    """Carries a robot on its contacts by joint torques, and merges what others request of its parts.

    The torques are `CarryingTorques` of the Robot's state, measured or, offline, desired. Positions and velocities of
    the desired State are those that the pipes of the configuration write there; joints without any desired value
    stay where they are at the start. Contacts are lifted and put down again by a service; torques then change within
    the time `fade`.
    """

    Tags = GravityTags

    def __init__(self, robot: Robot, tags: GravityTags | None = None, name: str = ""):
        super().__init__(robot, tags or GravityTags(), name or "gravity_compensation")
        self.dynamics = True
        free = np.setdiff1d(np.arange(robot.size), robot.actuated)
        if self.tags.free is not None:
            free = np.union1d(free, robot.selectors[self.tags.free].indices)
        self._contacts = self._tracked()
        # what holds a point needs no frame of its own: its three rows span the same in world axes
        self._rows: Handler[Point] = Handler(
            contact if contact.holds_a_point else ContactConstraint(contact) for contact in self._contacts.values()
        )
        # the Handler is this component's own: its arrays stay where they are
        self._jacobian = self._rows.jacobian if self._contacts else np.zeros((0, robot.size))
        self._carrying = CarryingTorques(robot.dynamics, free)
        robot.dynamics.subscribe(BIAS)
        self._gains = configured_gains(robot, self.tags.gains)
        self._before = np.zeros(robot.size)
        self._torque = np.zeros(robot.size)
        self._left = 0.0
        self._fade = self.tags.fade
        self._desired_positions = DesiredPositions(robot)
        self._springs = np.zeros(robot.size)

    def _tracked(self) -> dict[str, Point]:
        """Return the contacts of the group `track` by name."""
        contacts = self.model.contacts
        tracked = self.model.contacts.group(self.tags.track)
        if not tracked and "track" in self.tags.model_fields_set:
            raise ComponentError(
                f"no contact of '{self.tags.track}' carries '{self.model.name}'",
                where=self.tags.where("track"),
                expected="a robot configuration with `contacts: {read: true}`, and a group of links with contacts",
            )
        if not tracked and self.model.kinematics.base is not None:
            logger.warning("%s: '%s' has no contacts: nothing carries its base", self.name, self.model.name)
        return {name: contacts[name] for name in contacts.names if contacts[name] in tracked}

    def init(self) -> None:
        """Start with the joints that no other plugin moves where they are."""
        self._desired_positions.start()
        self._left = 0.0

    def update(self) -> None:
        """Compute the torques of this cycle."""
        self._desired_positions.read()
        if self._contacts:
            self._rows.update()
        np.copyto(self._torque, self._carrying.update(self._jacobian))
        if self._left > 0.0:
            self._left = max(self._left - self.time_step, 0.0)
            u = 1.0 - self._left / self._fade
            self._torque -= self._before
            self._torque *= u * u * u * (10.0 - u * (15.0 - 6.0 * u))
            self._torque += self._before

    def send(self) -> None:
        """Write torques, and the gains that are configured; positions and velocities are those that others request."""
        command = self.model.command
        command.torque[:] = self._torque
        self._desired_positions.send(self._desired_positions.values)
        for values, dofs, numbers in self._gains:
            values[dofs] = numbers

    def start_log(self, logger: Any) -> None:
        """Declare the torques, what the joints measure beyond them (those of the springs), and positions."""
        dofs = self.model.dofs
        logger.add("torque", self._torque, dofs)
        logger.add("spring_torque", self._springs, dofs)
        logger.add("reference", self._desired_positions.values, dofs)

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: what the joints measure beyond the torques."""
        np.subtract(self.model.state.torque, self._torque, out=self._springs)

    def services(self) -> tuple[Service, ...]:
        """Offer the service `<name>/lift`."""
        return (Service("lift", "solfer/LiftContacts", LiftContacts, reply=LiftReply, handler=self.lift),)

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer the gains, and the time `fade`, which counts from the next contact on."""
        return (LiveParameter(("fade",)), *live_gains(self.model, self.tags.gains, self._gains))

    def lift(self, request: LiftContacts) -> LiftReply:
        """Lift contacts, or put them down again; nothing changes if one of them is not tracked.

        Raises:
            UnknownName: A contact is not tracked.
        """
        for name in request.contacts:
            if name not in self._contacts:
                raise UnknownName("tracked contact", name, self._contacts, expected="a contact of the group `track`")
        self._before[:], self._left = self._torque, self.tags.fade
        self._fade = self.tags.fade
        for name in request.contacts or self._contacts:
            self._contacts[name].active = not request.lifted
        return LiftReply()
