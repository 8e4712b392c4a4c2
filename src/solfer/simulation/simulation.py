"""A robot with its lower level in a world."""

from pathlib import Path

import numpy as np

from solfer.errors import SimulationError, UnknownName
from solfer.simulation.bundle import Bundle, load_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.engines import make_engine
from solfer.simulation.loading.wheels import wheels_of
from solfer.simulation.physics import STEP, PhysicsEngine
from solfer.simulation.robot_body.body import Body
from solfer.simulation.robot_body.contacts import ContactDetector
from solfer.simulation.robot_body.motors import DRIVE_STATES, DriveState
from solfer.simulation.robot_body.placement import START_ORIGIN, StartPlacement, put
from solfer.simulation.robot_body.postures import Postures
from solfer.simulation.robot_body.pushes import Pushes
from solfer.simulation.sensors import Sensors
from solfer.simulation.state import BaseMotion, Moment, MotorSide, SimulationState, read_only
from solfer.simulation.world.records import WorldRecord
from solfer.simulation.world.world import FLAT_WORLD, World, read_world


class Simulation:
    """Steps a robot and its lower level together, one millisecond at a time. Equal inputs give bitwise equal motions.

    Args:
        bundle: The robot, and the state in which it begins.
        gui: Open the window of PyBullet; no effect on an `engine` that is there.
        world: What the robot stands on and bumps into.
        engine: What moves the robot: the name of an engine, or one that is empty yet, which is closed with the
            simulation; None: the one of the world.

    Attributes:
        q, v: Position and velocity of the model's DoFs, those of a floating base included, shape (model size,).
        torque: Torques on the joints in the newest step, those of the springs where there are any, shape (model size,)
            [Nm, N].
        q_before, v_before, torque_before: The same at the beginning of the newest step.
        start: Name of the state in which the simulation begins; None: the neutral posture.
        lower_level: The controllers.
        kinematics: Model of the robot, of which the lower level computes inertias and bias forces.
        state: What the robot does, read-only, for its sensors.
        sensors: What the robot measures.
        world: Everything but the robot.
        pushes: Wrenches from outside.

    Raises:
        SimulationError: The world or the robot in it cannot be made.
        UnknownName: There is no state of that name, or a sensor sits on a link that the robot does not have.
        ModelError: The state has a joint beyond its limits.
    """

    def __init__(
        self,
        bundle: Bundle,
        gui: bool = False,
        world: WorldRecord = FLAT_WORLD,
        *,
        engine: PhysicsEngine | str | None = None,
    ):
        kinematics = self.kinematics = bundle.kinematics
        drives = bundle.lower_level.drives
        self.lower_level = bundle.lower_level
        self.start = bundle.start
        self._groups = bundle.groups
        self._count = 0
        if engine is None or isinstance(engine, str):
            engine = make_engine(engine or world.engine, gui)
        self._engine = engine
        try:
            self.body = Body(
                self._engine,
                bundle.description,
                kinematics,
                motors=drives.speed_dofs,
                friction=bundle.friction,
                lossless=bundle.lossless,
                wheels=wheels_of(bundle.equipment.contacts),
            )
            self.world = World(self._engine, world, bundle.friction.ground)
            self._contacts = ContactDetector(self.body)
            self._before, self._now = np.zeros((2, 3, kinematics.size))
            self.q, self.v, self.torque = self._now
            self.q_before, self.v_before, self.torque_before = self._before
            self._motor_torque = np.zeros(len(drives.speed_dofs))
            if drives.two_mass is not None:
                self.body.push_motors()
            self._postures = Postures(bundle.states, bundle.start, kinematics)
            self.state = self._make_state()
            self.pushes = Pushes(self.body, self.state.now)
            self.sensors = Sensors(self.state, bundle.equipment)
            self._begin = self._engine.save_state()
            self.reset()
            self._engine.show(self.body.position)
        except Exception:
            self.close()
            raise

    def _make_state(self) -> SimulationState:
        """Make the view of the simulation that sensors have."""
        body = self.body
        base = BaseMotion(body.base_link, *map(read_only, (body.position, body.orientation, body.linear, body.angular)))
        motors = self.lower_level.drives.two_mass
        return SimulationState(
            body.joints,
            body.owner,
            base if body.floating else None,
            now=Moment(self.kinematics.twin(), self.q, self.v, torque=self.torque),
            before=Moment(self.kinematics.twin(), self.q_before, self.v_before, torque=self.torque_before),
            contact_points=self._contacts.points,
            clock=lambda: self.time,
            motors=None if motors is None else MotorSide(*map(read_only, motors.motor_side)),
        )

    @classmethod
    def from_file(
        cls,
        path: str | Path | BundleRecord,
        gui: bool = False,
        state: str | None = None,
        description_text: str | None = None,
        world: str | Path | None = None,
        *,
        engine: str | None = None,
    ) -> "Simulation":
        """Make the simulation of a robot's bundle.

        Args:
            path: The bundle's file, such as config/robots/centauro/robot.yaml.
            gui: Open PyBullet's window.
            state: Named state in which the simulation begins instead of the bundle's own.
            description_text: URDF that is used instead of the bundle's.
            world: File of the world; None: a plane.
            engine: Name of the physics engine; None: the one of the world.

        Raises:
            ConfigError, ModelError, UnknownName: A file of the bundle or of the world is wrong.
            SimulationError: The world or the robot in it cannot be made.
        """
        around = FLAT_WORLD if world is None else read_world(world)
        simulation = cls(load_bundle(path, description_text), gui, around, engine=engine)
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
        return self.body.floating

    def reset(
        self, state: str | None = None, placement: StartPlacement = START_ORIGIN, seed: int | None = None
    ) -> None:
        """Begin again at rest in a named state (default: the start), upright on the ground below the robot.

        Commands and pushes are forgotten, drives are repaired, movable parts of the world are where they were, noise
        begins again. Time goes on, and friction stays as it was set. What follows is bitwise what follows the same
        reset at any other time.

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
        if not self.floating and placement != START_ORIGIN:
            raise SimulationError("the robot's base is fixed", expected="no x, y, yaw and height")
        highest = 2**63 - 1
        if seed is not None and not 0 <= seed <= highest:
            raise SimulationError(f"the seed is {seed}", expected=f"from 0 to {highest}")
        self._put(posture, placement)
        self.pushes.clear()
        self.torque[:] = 0.0
        self._motor_torque[:] = 0.0
        for joint in self.body.broken_drives:
            self.set_drive(joint, "sound")
        self._read()
        self._remember()
        self.lower_level.start(self.q)
        self.lower_level.drives.place(self.q)
        self.sensors.restart(seed)

    def recover(self) -> None:
        """Begin again at rest in the start, after the simulation diverged; see `reset`."""
        self._engine.restore_state(self._begin)
        self.reset()

    def step(self) -> None:
        """Advance by one millisecond.

        Raises:
            SimulationError: The numbers of the world have grown beyond all bounds.
        """
        self._remember()
        torque, speed = self.lower_level.update(self.q, self.v, STEP)
        self.body.apply(torque, speed)
        self.pushes.apply()
        self._engine.step()
        self._count += 1
        self._read()
        self.torque[:] = torque
        if self._motor_torque.size:
            self.torque[self.lower_level.drives.speed_dofs] += self._motor_torque

    def set_friction(self, name: str, coefficient: float) -> None:
        """Change a friction coefficient; those of two bodies that touch are multiplied.

        Args:
            name: A part of the world (`ground` is the plane), a link of the robot, or a group of its links.
            coefficient: From 0 to 10.

        Raises:
            UnknownName: Nothing has that name.
            SimulationError: The coefficient is beyond its bounds.
        """
        if not 0.0 <= coefficient <= 10.0:
            raise SimulationError(f"the friction of '{name}' is {coefficient:g}", expected="from 0 to 10")
        if name in self.world.names:
            self.world.set_friction(name, coefficient)
        elif name in self.body.owner or name in self._groups:
            for link in self._groups.get(name, ()) if name not in self.body.owner else (name,):
                self.body.set_friction(link, coefficient)
        else:
            raise UnknownName(
                "part of the world, link or group", name, [*self.world.names, *self.body.owner, *self._groups]
            )

    def set_drive(self, joint: str, state: DriveState) -> None:
        """Break the drive of a joint, or repair it; a reset repairs all. A repaired one goes smoothly to its command.

        Args:
            joint: Name of the joint.
            state: `sound`; `free`: without power; `stuck`: the joint does not move, whatever is commanded.

        Raises:
            UnknownName: The robot has no such joint, or a drive no such state.
        """
        if joint not in self.body.joints:
            raise UnknownName("joint", joint, self.body.joints)
        if state not in DRIVE_STATES:
            raise UnknownName("state of a drive", state, DRIVE_STATES)
        self.lower_level.power(self.kinematics.dofs.index(joint), state != "free")
        self.body.change_drive(joint, state)

    def contacts(self) -> dict[str, np.ndarray]:
        """Return the force of the world on each link that touches it, in world axes, shape (3,) [N]."""
        return self._contacts.forces()

    def contact_links(self) -> tuple[str, ...]:
        """Return the names of the links that touch the world."""
        return self._contacts.links()

    def close(self) -> None:
        """Release the world. May be called twice."""
        self._engine.close()

    def _put(self, posture: np.ndarray, placement: StartPlacement) -> None:
        """Put robot and world where they begin; if that is impossible they stay where they are."""
        before = self._engine.save_state()
        try:
            self.body.place(posture, (0.0, 0.0, 500.0))  # where nothing is
            self.world.scatter()
            self._engine.clear_contacts()
            self.world.reset()
            if self.floating:
                put(self.body, self.world, posture, placement=placement)
            else:
                self.body.place(posture)
        except SimulationError:
            self._engine.restore_state(before)
            raise
        finally:
            self._engine.remove_state(before)

    def _remember(self) -> None:
        """Keep the state in which a step begins."""
        self._before[:] = self._now
        self.state.before.expire()

    def _read(self) -> None:
        self.state.now.expire()
        self.body.read(self.q, self.v, self._motor_torque)
        highest = 1e6  # norm of all speeds [rad/s, m/s], which stays far below in a world that makes sense
        if not float(self.v.dot(self.v)) < highest**2:  # true for NaN as well
            raise SimulationError(
                f"the simulation diverged after {self.time:g} s",
                expected="smaller gains or forces, or masses and inertias as the real robot has them",
            )
