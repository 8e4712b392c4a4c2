"""A robot with its lower level in a PyBullet world."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.errors import NotFinite, SimulationError, UnknownName
from solfer.lower_level import LowerLevel
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.simulation.bundle import load_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.robot_body.body import Body
from solfer.simulation.robot_body.contacts import ContactDetector
from solfer.simulation.robot_body.friction import motor_friction
from solfer.simulation.robot_body.placement import ORIGIN, StartPlacement, fix, put
from solfer.simulation.robot_body.postures import Postures
from solfer.simulation.robot_body.pushes import Pushes
from solfer.simulation.sensors import Equipment, Sensors
from solfer.simulation.world.engine import STEP, Engine
from solfer.simulation.world.records import Friction, WorldRecord
from solfer.simulation.world.world import FLAT, World, read_world
from solfer.transport.messages import BodyMessage, JointMessage

NORMAL_FRICTION = Friction()
NO_EQUIPMENT = Equipment()
AWAY = (0.0, 0.0, 500.0)  # [m], where nothing is
LARGEST_FRICTION = 10.0
LARGEST_SEED = 2**63 - 1
DIVERGED = 1e6  # [rad/s, m/s]; the norm of all speeds stays far below in a world that makes sense


class Simulation:
    """Steps a robot and its lower level together, one millisecond at a time. Equal inputs give bitwise equal motions.

    Args:
        description: The robot.
        kinematics: Its model.
        lower_level: Its controllers.
        states: Named states: joint positions by name. Joints that a state does not name are as in `start`.
        start: Name of the state in which the simulation begins, and which completes the others; without one, it
            begins in the neutral posture of the robot.
        friction: Friction of the robot and of the ground.
        gui: Open PyBullet's window.
        equipment: What the robot measures with.
        world: What the robot stands on and bumps into.
        groups: Links of the robot by the name of their group, for `set_friction`.

    Attributes:
        q, v: Position and velocity of the model's DoFs, those of a floating base included, shape (model size,).
        torque: Torques on the joints in the newest step, those of the drives without the friction in the motors, shape
            (model size,) [Nm, N].
        q_before, v_before, torque_before: The same at the beginning of the newest step.
        start: Name of the state in which the simulation begins; None: the neutral posture.
        lower_level: The controllers.
        sensors: What the robot measures.
        world: Everything but the robot.
        pushes: Wrenches from outside.

    Raises:
        SimulationError: The world or the robot in it cannot be made.
        UnknownName: There is no state of the name `start`.
        ModelError: A state has a joint beyond its limits.
    """

    def __init__(
        self,
        description: Description,
        kinematics: Kinematics,
        lower_level: LowerLevel,
        states: Mapping[str, Mapping[str, float]] | None = None,
        start: str | None = None,
        friction: Friction = NORMAL_FRICTION,
        gui: bool = False,
        equipment: Equipment = NO_EQUIPMENT,
        world: WorldRecord = FLAT,
        groups: Mapping[str, Sequence[str]] | None = None,
    ):
        self.kinematics, self.lower_level = kinematics, lower_level
        self.start, self._groups, self._count = start, groups or {}, 0
        self._engine = Engine(gui)
        try:
            self.body = Body(self._engine, description, kinematics, lower_level.drives.speed_dofs, friction)
            self.world = World(self._engine, world, friction.ground)
            self.pushes = Pushes(self._engine, self.body, kinematics)
            self._contacts = ContactDetector(self._engine, self.body)
            self.q, self.v, self.torque = (np.zeros(kinematics.size) for _ in range(3))
            self.q_before, self.v_before, self.torque_before = (np.zeros(kinematics.size) for _ in range(3))
            self._motor_torque = np.zeros(len(lower_level.drives.speed_dofs))
            self._friction = motor_friction(kinematics, equipment.actuators)
            self._rubbing, self._applied = np.zeros((2, kinematics.size))
            if self._friction is not None:
                self.body.push_motors()
            self._first = kinematics.size - len(self.body.joints)
            joints = slice(self._first, None)
            self._postures = Postures(states or {}, start, kinematics)
            self._joint_message = JointMessage(self.body.joints, self.q[joints], self.v[joints], self.torque[joints])
            body = self.body
            self._base_message = BodyMessage(
                "world", body.base_link, body.position, body.orientation, body.linear, body.angular
            )
            self.sensors = Sensors(self, self._contacts, equipment)
            self._begin = self._engine.keep()
            self.reset()
            self._engine.show(self.body.position)
        except Exception:
            self.close()
            raise

    @classmethod
    def from_file(
        cls,
        path: str | Path | BundleRecord,
        gui: bool = False,
        state: str | None = None,
        description_text: str | None = None,
        world: str | Path | None = None,
    ) -> "Simulation":
        """Make the simulation of a robot's bundle.

        Args:
            path: The bundle's file, such as config/robots/centauro/robot.yaml.
            gui: Open PyBullet's window.
            state: Named state in which the simulation begins instead of the bundle's own.
            description_text: URDF that is used instead of the bundle's.
            world: File of the world; None: a plane.

        Raises:
            ConfigError, ModelError, UnknownName: A file of the bundle or of the world is wrong.
            SimulationError: The world or the robot in it cannot be made.
        """
        around = FLAT if world is None else read_world(world)
        bundle = load_bundle(path, description_text)
        simulation = cls(
            bundle.description,
            bundle.kinematics,
            bundle.lower_level,
            bundle.states,
            bundle.start,
            bundle.friction,
            gui,
            bundle.equipment,
            around,
            bundle.groups,
        )
        if state is not None:
            try:
                simulation.reset(state)
            except Exception:
                simulation.close()
                raise
        return simulation

    @property
    def time(self) -> float:
        """Simulated time since the simulation was made [s]; it never goes back, not even in a reset."""
        return self._count * STEP

    @property
    def offer(self) -> str:
        """What the robot offers to plugins, in one line for a log."""
        controllers = self.lower_level.controllers.items()
        published = ", ".join(f"{name} ({len(controller.joints)} joints)" for name, controller in controllers)
        return f"{self.kinematics.size} DoFs; receives commands for {published}"

    @property
    def count(self) -> int:
        """Steps since the simulation was made."""
        return self._count

    @property
    def floating(self) -> bool:
        """Whether the robot's base moves."""
        return self.kinematics.base is not None

    def reset(self, state: str | None = None, placement: StartPlacement = ORIGIN, seed: int | None = None) -> None:
        """Begin again at rest in a named state (default: the start), upright on the ground below the robot.

        Commands and pushes are forgotten, movable parts of the world are where they were, noise begins anew. Time goes
        on, and friction stays as it was set. What follows is bitwise what follows the same reset at any other time.

        Args:
            state: Name of the state.
            placement: Where the robot is put, if its base floats.
            seed: Seed of the sensors' noise; None: that of the robot's bundle.

        Raises:
            UnknownName: There is no such state.
            ModelError: The state has a joint beyond its limits.
            SimulationError: The robot cannot be put there, or the seed is beyond its bounds. All is as it was then.
        """
        posture = self._postures.positions_of(state)
        placement.check()
        if not self.floating and placement != ORIGIN:
            raise SimulationError("the robot's base is fixed", expected="no x, y, yaw and height")
        if seed is not None and not 0 <= seed <= LARGEST_SEED:
            raise SimulationError(f"the seed is {seed}", expected=f"from 0 to {LARGEST_SEED}")
        self._put(posture, placement)
        self.pushes.clear()
        self.torque[:], self._motor_torque[:] = 0.0, 0.0
        self._read()
        self._remember()
        self.lower_level.start(self.q)
        self.sensors.restart(seed)

    def recover(self) -> None:
        """Begin again at rest in the start, after the simulation diverged; see `reset`."""
        self._engine.bring_back(self._begin)
        self.reset()

    def step(self) -> None:
        """Advance by one millisecond.

        Raises:
            SimulationError: The numbers of the world have grown beyond all bounds.
        """
        self._remember()
        torque, speed = self.lower_level.update(self.q, self.v, STEP)
        self.body.apply(self._rub(torque), speed)
        self.pushes.apply(self.q)
        self._engine.step()
        self._count += 1
        self._read()
        self.torque[:] = torque
        self.torque[self.lower_level.drives.speed_dofs] = self._motor_torque
        if self._friction is not None:
            self.torque -= self._rubbing

    def set_friction(self, name: str, coefficient: float) -> None:
        """Change a friction coefficient; those of two bodies that touch are multiplied.

        Args:
            name: A part of the world (`ground` is the plane), a link of the robot, or a group of its links.
            coefficient: From zero to LARGEST_FRICTION.

        Raises:
            UnknownName: Nothing has that name.
            SimulationError: The coefficient is beyond its bounds.
        """
        if not 0.0 <= coefficient <= LARGEST_FRICTION:
            raise SimulationError(
                f"the friction of '{name}' is {coefficient:g}", expected=f"from 0 to {LARGEST_FRICTION:g}"
            )
        if name in self.world.names:
            self.world.set_friction(name, coefficient)
        elif name in self.body.owner or name in self._groups:
            for link in self._groups.get(name, ()) if name not in self.body.owner else (name,):
                self.body.set_friction(link, coefficient)
        else:
            raise UnknownName(
                "part of the world, link or group", name, [*self.world.names, *self.body.owner, *self._groups]
            )

    def joint_message(self) -> JointMessage:
        """Return the positions, velocities and torques of the joints; the arrays are live."""
        self._joint_message.stamp = self.time
        return self._joint_message

    def base_message(self) -> BodyMessage:
        """Return the pose and twist of the base link's origin in the world; the arrays are live."""
        self._base_message.stamp = self.time
        return self._base_message

    def contacts(self) -> dict[str, np.ndarray]:
        """Return the force of the world on each link that touches it, in world axes, shape (3,) [N]."""
        return self._contacts.forces()

    def contact_links(self) -> tuple[str, ...]:
        """Return the names of the links that touch the world."""
        return self._contacts.links()

    def close(self) -> None:
        """Release the world. May be called twice."""
        self._engine.close()

    def _rub(self, torque: np.ndarray) -> np.ndarray:
        """Subtract what friction in the motors takes of the drives' torques at the present speed, shape (size,)."""
        if self._friction is None:
            return torque
        np.multiply(self._friction, self.v, out=self._rubbing)
        return np.subtract(torque, self._rubbing, out=self._applied)

    def _put(self, posture: np.ndarray, placement: StartPlacement) -> None:
        """Put robot and world where they begin; if that is impossible they stay where they are."""
        before = self._engine.keep()
        try:
            self.body.place(posture, AWAY)
            self.world.scatter()
            self._engine.forget_contacts()
            self.world.reset()
            if self.floating:
                put(self.body, self.world, posture, placement)
            else:
                fix(self.body, self.world, posture)
        except SimulationError:
            self._engine.bring_back(before)
            raise
        finally:
            self._engine.forget(before)

    def _remember(self) -> None:
        """Keep the state in which a step begins."""
        np.copyto(self.q_before, self.q)
        np.copyto(self.v_before, self.v)
        np.copyto(self.torque_before, self.torque)

    def _read(self) -> None:
        try:
            self.body.read(self.q, self.v, self._motor_torque)
            diverged = not float(np.dot(self.v, self.v)) < DIVERGED**2  # true for NaN as well
        except NotFinite:
            diverged = True
        if diverged:
            raise SimulationError(
                f"the simulation diverged after {self.time:g} s",
                expected="smaller gains or forces, or masses and inertias as the real robot has them",
            )
