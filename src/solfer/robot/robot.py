"""The Robot: model, states and maps behind one facade (section 1.1 of the paper)."""

from collections.abc import Callable, Sequence
from copy import copy
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from solfer.errors import UnknownName
from solfer.model import Actuators, Description, Kinematics, Semantics, State
from solfer.model.contacts import ContactRecord
from solfer.model.observation import End, observed
from solfer.robot.defaults import (
    ALL,
    actuated_dofs,
    default_maps,
    group_selectors,
    joint_limits,
    undescribed,
)
from solfer.robot.description.files import read_parts
from solfer.robot.robot_points import RobotPoints

if TYPE_CHECKING:
    from solfer.dynamics import DynamicModel
    from solfer.points import CenterOfMass, CenterOfPressure
    from solfer.robot.contacts import Contacts


class _Measured:
    """What was computed of the measured State, for a Robot and all its companions.

    Args:
        robot: The first of them.
        contacts: Its contacts.

    Attributes:
        position, velocity: Numbers that the kinematics were computed at.
        points: The points that every Robot has.
    """

    def __init__(self, robot: "Robot", contacts: Sequence[ContactRecord]):
        self._robot = robot
        self.position = self.velocity = b""
        self.points = RobotPoints(robot, contacts)

    @cached_property
    def dynamics(self) -> "DynamicModel":
        """Dynamics of the measured State."""
        # scipy behind it takes a while to load
        from solfer.dynamics import DynamicModel

        return DynamicModel(self._robot)


class Robot:
    """The robot as its components see it. DoFs have the order of `dofs` everywhere.

    What is measured, and what is computed of it, several components of a process have in common: each has a `companion`
    of one Robot, with a desired State of its own.

    Args:
        kinematics: Kinematics of the robot, and its description.
        semantics: Groups and named states.
        actuators: Actuators of its DoFs; None: nothing is known of them, and every joint has a drive.
        name: Name of the robot (default: that of its URDF).
        contacts: Its contacts.
        others: The whole robot or its other parts, where the model is a part of it.

    Attributes:
        name: Name of the robot.
        kinematics: Kinematics and dynamics of the model.
        description: Links and joints of the URDF.
        semantics: Groups and named states of the SRDF.
        actuators: Actuators.
        state: Measured state, on the link side.
        motor: Measured state, on the motor side.
        command: Desired state.
        lower_limits: Lower limits of position, velocity, acceleration and torque; -inf where there is none.
        upper_limits: Upper limits; inf where there is none.
        revolutions: Angle after which a joint is where it was: 2 pi if it is continuous, else 0, shape (n,) [rad].
        added_revolutions: What measured positions have more than the robot's driver publishes, shape (n,) [rad]; live.
        maps: Bidirectional maps: `RBDL` (also called `MODEL`), `ACTUATED`, and those that a configuration adds.
        selectors: Unidirectional maps: `all` and every group of the SRDF.
        contact_records: Records of its contacts.
        is_whole: Whether no other part of the robot has links with masses that this one lacks.
        actuated: Indices of the DoFs that have a drive: of those that the actuators' file lists, or without a file all
            but those of a floating base, shape (m,).
        center_of_mass: Centre of mass in the world as of the last `update` [m].
        contacts: Contacts with the ground as of the last `update`: their positions [m] and the reaction forces there
            [N].
        center_of_pressure: Centre of pressure of the contacts as of the last `update`, for the forces that they have
            now [m]; a PointError where the robot has no contacts.
        dynamics: Dynamics of the measured state, one model for all users of this Robot (section 1.2 of the paper).
    """

    center_of_mass: "CenterOfMass" = property(attrgetter("_measured.points.center_of_mass"))  # type: ignore[assignment]
    contacts: "Contacts" = property(attrgetter("_measured.points.contacts"))  # type: ignore[assignment]
    center_of_pressure: "CenterOfPressure" = property(  # type: ignore[assignment]
        attrgetter("_measured.points.center_of_pressure")
    )
    dynamics: "DynamicModel" = property(attrgetter("_measured.dynamics"))  # type: ignore[assignment]

    def __init__(
        self,
        kinematics: Kinematics,
        semantics: Semantics | None = None,
        actuators: Actuators | None = None,
        name: str = "",
        contacts: Sequence[ContactRecord] = (),
        *,
        others: Sequence[Description] = (),
    ):
        self.kinematics = kinematics
        self.description = kinematics.description
        self.name = name or self.description.name
        self.semantics = semantics or Semantics()
        self.actuators = actuators or undescribed(kinematics)
        kinematics.drive(self.actuators)
        self.state, self.motor, self.command = State(self.dofs), State(self.dofs), State(self.dofs)
        self.lower_limits, self.upper_limits = joint_limits(kinematics)
        self.revolutions = kinematics.revolutions
        self.added_revolutions = np.zeros(kinematics.size)
        self.actuated = actuated_dofs(kinematics, self.actuators)
        self.maps, self.selectors = (
            default_maps(kinematics, self.actuated),
            group_selectors(kinematics, self.semantics),
        )
        self._places = {dof: index for index, dof in enumerate(self.dofs)}
        # arrays of a State stay where they are
        self._position = self.state.position
        self._velocity = self.state.velocity
        self._acceleration = self.state.acceleration
        self._followers = kinematics.followers or None
        self.contact_records = tuple(contacts)
        weighing = {link.name for other in others for link in other.links.values() if link.mass}
        self.is_whole = weighing <= self.description.links.keys()
        self._measured = _Measured(self, self.contact_records)

    @classmethod
    def load(
        cls,
        urdf: str | Path,
        srdf: str | Path | None = None,
        floating_base: bool | None = None,
        actuators: str | Path | None = None,
        name: str | None = None,
        *,
        others: Sequence[str | Path] = (),
        contacts: str | Path | None = None,
    ) -> "Robot":
        """Load a robot from files, or from their texts.

        Args:
            urdf: URDF: a path, or the text itself.
            srdf: SRDF: a path, or the text itself.
            floating_base: Whether the base moves; None follows the URDF.
            actuators: YAML file of the actuators.
            name: Name of the robot (default: that of its URDF), and its key in the files of actuators and contacts.
            others: URDFs of the whole robot or its other parts, where SRDF, actuators and contacts describe more than
                `urdf`.
            contacts: YAML file of the contacts.

        Raises:
            ModelError: A description cannot be used.
            UnknownName: A description names something that is not there.
            ConfigError: The actuators or contacts do not fit.
            SolferErrors: Several of these.
        """
        parts = read_parts(urdf, srdf, floating_base, actuators=actuators, name=name, others=others, contacts=contacts)
        return cls(
            parts.kinematics,
            parts.semantics,
            parts.actuators,
            name=parts.name,
            contacts=parts.contacts,
            others=parts.others,
        )

    def companion(self) -> "Robot":
        """Return the same Robot for another component, with a desired State of its own.

        Shared is all that is measured and all that is computed of it: `state` and `motor` with added interfaces,
        kinematics, dynamics with their subscriptions, contacts with their wrenches, centres of mass and pressure.
        `command` and `maps`, at first those that every Robot has, are the companion's own.
        """
        other = copy(self)
        other.state, other.motor, other.command = self.state.window(), self.motor.window(), State(self.dofs)
        other.maps = default_maps(self.kinematics, self.actuated)
        return other

    def twin(self) -> "Robot":
        """Return the same robot with a state of its own, and all that is computed of it: a model of what it is to do.

        Nothing measures its states; who has it writes them. Model, groups and limits are shared.
        """
        other = copy(self)
        other.kinematics = self.kinematics.twin()
        other.state, other.motor, other.command = State(self.dofs), State(self.dofs), State(self.dofs)
        other.maps = default_maps(other.kinematics, self.actuated)
        other._position = other.state.position
        other._velocity = other.state.velocity
        other._acceleration = other.state.acceleration
        other._followers = other.kinematics.followers or None
        other._measured = _Measured(other, self.contact_records)
        return other

    def shares_measurement(self, other: "Robot") -> bool:
        """Return whether this is a companion of another Robot, or the other one of this, or both of a third one."""
        return self._measured is other._measured

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the DoFs."""
        return self.kinematics.dofs

    @property
    def size(self) -> int:
        """Number of DoFs n."""
        return self.kinematics.size

    @property
    def gravity(self) -> np.ndarray:
        """Acceleration of gravity in the world, shape (3,) [m/s^2]."""
        return self.kinematics.gravity

    def dof(self, name: str) -> int:
        """Return the index of a DoF; an UnknownName if there is none of that name."""
        if name not in self._places:
            raise UnknownName("DoF", name, self.dofs)
        return self._places[name]

    def links(self, group: str) -> tuple[str, ...]:
        """Return the links of a group, or all links for `all`; an UnknownName if there is no such group."""
        if group in self.semantics.groups:
            return self.semantics.groups[group].links
        if group == ALL:
            return tuple(self.description.links)
        raise UnknownName("group", group, self.selectors)

    def named_state(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the indices of the DoFs in a named state, and their values [rad, m], shape (k,) each.

        Raises:
            UnknownName: There is no such state.
        """
        if name not in self.semantics.states:
            raise UnknownName("state", name, self.semantics.states)
        values = self.semantics.states[name]
        held = [joint for joint in values if joint in self._places]
        return np.array([self._places[joint] for joint in held], dtype=np.intp), np.array([values[j] for j in held])

    def update(self) -> bool:
        """Bring the kinematics up to date with `state`; True if position or velocity changed since the last time.

        The last time is that of this Robot or of one of its companions. Writing the arrays of `state` directly counts
        as a change, and moves their versions. Joints that follow others get their numbers here.
        """
        if self._followers is not None:
            self.follow()
        # to compare 2 x 48 numbers takes 0.2 us, the kinematics take 3 us
        measured = self._measured
        position = self._position.tobytes()
        velocity = self._velocity.tobytes()
        moved = position != measured.position
        accelerated = velocity != measured.velocity
        if not (moved or accelerated):
            return False
        self.kinematics.update(self._position, self._velocity)
        versions = self.state.versions
        versions["position"] += moved
        versions["velocity"] += accelerated
        measured.position = position
        measured.velocity = velocity
        measured.points.updates += 1
        return True

    def follow(self) -> None:
        """Write the numbers of joints that follow others to `state`, by those of their leaders."""
        if self._followers is not None:
            self._followers.follow(self._position, self._velocity, self._acceleration)

    def computations(self) -> dict[str, int]:
        """Count what was computed of the measured State so far, by this Robot and its companions together.

        Returns:
            How often, for `kinematics`, each of the points that every Robot has, and each element of the dynamics;
            elements of dynamics that were not requested are left out.
        """
        measured = self._measured
        counts = {"kinematics": measured.points.updates, **measured.points.computed}
        return counts | (measured.dynamics.manager.computations() if "dynamics" in vars(measured) else {})

    def observe(self, listener: Callable[[str], None]) -> list[End]:
        """Call `listener` with the name of what was computed, as `computations` names it, by whichever companion.

        That costs nothing before, nor after the returned functions were called, which end it.
        """
        return [
            observed(self.kinematics, "update", lambda *_: listener("kinematics")),
            observed(self._measured.points, "compute", lambda _, name, point: listener(name)),
            *self.dynamics.manager.observe(listener),
        ]

    def __repr__(self) -> str:
        return (
            f"Robot({self.name}: {self.size} DoFs, {len(self.actuated)} actuated, "
            f"{len(self.semantics.groups)} groups, {len(self.semantics.states)} states, "
            f"maps {', '.join(self.maps)})"
        )
