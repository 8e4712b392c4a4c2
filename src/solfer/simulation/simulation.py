"""A robot with its lower level in a PyBullet world."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from solfer.errors import ModelError, SimulationError, UnknownName
from solfer.lower_level import LowerLevel
from solfer.model.description import Description
from solfer.model.kinematics import Kinematics
from solfer.pipes.messages import BodyMessage, JointMessage
from solfer.simulation.body import Body
from solfer.simulation.bundle import load_bundle
from solfer.simulation.contacts import Contacts
from solfer.simulation.engine import STEP, Engine
from solfer.simulation.friction import Friction
from solfer.simulation.sensors import Equipment, Sensors

NORMAL_FRICTION = Friction()
NO_EQUIPMENT = Equipment()
OVERLAP = 1e-5  # [m] into the ground, so that the very first step finds the contacts
DIVERGED = 1e6  # [rad/s, m/s]; the norm of all speeds stays far below in a world that makes sense


class Simulation:
    """Steps a robot and its lower level together, one millisecond at a time. Equal inputs give bitwise equal motions.

    Args:
        description: The robot.
        kinematics: Its model.
        lower_level: Its controllers.
        states: Named states: joint positions by name. Joints that a state does not name are as in `start`.
        start: Name of the state in which the simulation begins, and which completes the others; without one, all
            joints begin at zero, or at the limit that is next to it.
        friction: Friction of the robot and of the ground.
        gui: Open PyBullet's window.
        equipment: What the robot measures with.

    Attributes:
        q, v: Position and velocity of the model's DoFs, those of a floating base included, shape (model size,).
        torque: Torques that were really applied in the newest step, shape (model size,) [Nm, N].
        q_before, v_before, torque_before: The same at the beginning of the newest step.
        lower_level: The controllers.
        sensors: What the robot measures.

    Raises:
        SimulationError: The world or the robot in it cannot be made.
        UnknownName: There is no state of the name `start`.
        ModelError: A state has a joint beyond its limits.
    """

    def __init__(self, description: Description, kinematics: Kinematics, lower_level: LowerLevel,
                 states: Mapping[str, Mapping[str, float]] | None = None, start: str | None = None,
                 friction: Friction = NORMAL_FRICTION, gui: bool = False,
                 equipment: Equipment = NO_EQUIPMENT):
        self.kinematics, self.lower_level = kinematics, lower_level
        self._engine = Engine(gui, friction.ground)
        try:
            self.body = Body(self._engine, description, kinematics, lower_level.speed_dofs, friction)
            self._contacts = Contacts(self._engine, self.body)
            self._states, self._start = states or {}, start
            self.q, self.v, self.torque = (np.zeros(kinematics.size) for _ in range(3))
            self.q_before, self.v_before, self.torque_before = (np.zeros(kinematics.size) for _ in range(3))
            self._motor_torque = np.zeros(len(lower_level.speed_dofs))
            self._first = kinematics.size - len(self.body.joints)
            joints = slice(self._first, None)
            self._joint_message = JointMessage(self.body.joints, self.q[joints], self.v[joints], self.torque[joints])
            body = self.body
            self._base_message = BodyMessage("world", body.base_link, body.position, body.orientation, body.linear,
                                             body.angular)
            self.sensors = Sensors(self, self._contacts, equipment)
            self.reset()
        except Exception:
            self.close()
            raise

    @classmethod
    def from_file(cls, path: str | Path, gui: bool = False, state: str | None = None,
                  description_text: str | None = None) -> "Simulation":
        """The simulation of a robot's bundle.

        Args:
            path: The bundle's file, such as config/robots/centauro/robot.yaml.
            gui: Open PyBullet's window.
            state: Named state in which the simulation begins instead of the bundle's own.
            description_text: URDF that is used instead of the bundle's.

        Raises:
            ConfigError, ModelError, UnknownName: A file of the bundle is wrong.
            SimulationError: The world or the robot in it cannot be made.
        """
        bundle = load_bundle(path, description_text)
        simulation = cls(bundle.description, bundle.kinematics, bundle.lower_level, bundle.states, bundle.start,
                         bundle.friction, gui, bundle.equipment)
        if state is not None:
            try:
                simulation.reset(state)
            except Exception:
                simulation.close()
                raise
        return simulation

    @property
    def time(self) -> float:
        """Simulated time since the newest reset [s]."""
        return self._count * STEP

    @property
    def count(self) -> int:
        """Steps since the newest reset."""
        return self._count

    @property
    def floating(self) -> bool:
        """Whether the robot's base moves."""
        return self.kinematics.base is not None

    def reset(self, state: str | None = None) -> None:
        """Begin again at rest in a named state (default: the start), upright, the lowest shape touching the ground.

        Raises:
            UnknownName: There is no such state.
            ModelError: The state has a joint beyond its limits.
        """
        posture = self._posture(state)
        self.body.place(posture)
        if self.floating:
            self.body.place(posture, position=(0.0, 0.0, -self.body.height() - OVERLAP))
        self._count = 0
        self.torque[:] = 0.0
        self._read()
        self._remember()
        self.lower_level.start(self.q)
        self.sensors.restart()

    def step(self) -> None:
        """Advance by one millisecond.

        Raises:
            SimulationError: The numbers of the world have grown beyond all bounds.
        """
        self._remember()
        torque, speed = self.lower_level.update(self.q, self.v, STEP)
        self.body.apply(torque, speed)
        self._engine.step()
        self._count += 1
        self._read()
        self.torque[:] = torque
        self.torque[self.lower_level.speed_dofs] = self._motor_torque

    def joint_message(self) -> JointMessage:
        """Positions, velocities and torques of the joints; the arrays are live."""
        self._joint_message.stamp = self.time
        return self._joint_message

    def base_message(self) -> BodyMessage:
        """Pose and twist of the base link's origin in the world; the arrays are live."""
        self._base_message.stamp = self.time
        return self._base_message

    def contacts(self) -> dict[str, np.ndarray]:
        """Force of the world on each link that touches it, in world axes, shape (3,) [N]."""
        return self._contacts.forces()

    def contact_links(self) -> tuple[str, ...]:
        """Names of the links that touch the world."""
        return self._contacts.links()

    def close(self) -> None:
        """Release the world. May be called twice."""
        self._engine.close()

    def _remember(self) -> None:
        """Keep what a step begins with."""
        np.copyto(self.q_before, self.q)
        np.copyto(self.v_before, self.v)
        np.copyto(self.torque_before, self.torque)

    def _read(self) -> None:
        self.body.read(self.q, self.v, self._motor_torque)
        speed = float(np.dot(self.v, self.v))
        if not speed < DIVERGED**2:  # true for NaN as well
            raise SimulationError(f"the simulation diverged after {self.time:g} s")

    def _posture(self, state: str | None) -> np.ndarray:
        """Positions of the joints in a named state, shape (joints,) [rad]."""
        lower, upper = self.kinematics.lower_position[self._first:], self.kinematics.upper_position[self._first:]
        posture = np.clip(0.0, lower, upper)
        place = {joint: index for index, joint in enumerate(self.body.joints)}
        for name in dict.fromkeys(name for name in (self._start, state) if name is not None):
            if name not in self._states:
                raise UnknownName("state", name, self._states)
            for joint, value in self._states[name].items():
                if joint in place:
                    posture[place[joint]] = value
        for joint, index in place.items():
            if not lower[index] - 1e-9 <= posture[index] <= upper[index] + 1e-9 or not math.isfinite(posture[index]):
                raise ModelError(f"state '{state or self._start}' has joint '{joint}' at {posture[index]:g}",
                                 expected=f"from {lower[index]:g} to {upper[index]:g} [rad]")
        return posture
