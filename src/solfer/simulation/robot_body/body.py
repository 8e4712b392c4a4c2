"""A robot in the world of a physics engine: its state, its motors, and where it is put."""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from solfer.lower_level.gains.defaults import free_inertia
from solfer.model.followers import Followers
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture
from solfer.model.urdf.description import Description
from solfer.simulation.loading.wheels import NO_WHEELS, TorusWheel
from solfer.simulation.physics import PhysicsEngine
from solfer.simulation.robot_body.base import FloatingBase
from solfer.simulation.robot_body.motors import BodyMotors, DriveState
from solfer.simulation.world.records import Friction

SEARCH_DISTANCES = (0.005, 0.05, 0.5, 100.0)
"""How far away other bodies are searched for, one after the other [m]: of a grid, each triangle is a find."""


class Body:
    """A robot in the world. Joints and DoFs have the model's order.

    Args:
        engine: The world.
        description: The robot.
        kinematics: Its model; the body floats if the model has a floating base.
        motors: DoFs with motors that hold a speed; all other joints are driven by torques.
        friction: Friction of its links.
        lossless: Joints without the damping and friction of the description.
        wheels: Wheels by link.

    Attributes:
        robot: The robot as the engine has loaded it.
        joints: Names of the joints.
        links: Names of the links that the engine has; the base is the last.
        owner: For each link of the description, the link of the engine that it became part of.
        floating: Whether the base moves.
        position, orientation: Pose of the base link's origin in the world, shape (3,) [m] and (4,), (x, y, z, w); live.
        linear, angular: Velocity of its origin [m/s] and angular velocity [rad/s] in world axes, shape (3,) each; live.
        base_link: Link that `position`, `orientation`, `linear` and `angular` belong to.

    Raises:
        SimulationError: The engine cannot load the robot, or `friction` names a link that it does not have.
    """

    def __init__(
        self,
        engine: PhysicsEngine,
        description: Description,
        kinematics: Kinematics,
        motors: np.ndarray,
        friction: Friction,
        *,
        lossless: Collection[str] = (),
        wheels: Mapping[str, TorusWheel] = NO_WHEELS,
    ):
        floats = kinematics.base is not None
        self._first = 6 if floats else 0
        self.joints = tuple(kinematics.dofs[self._first :])
        self.robot = engine.load_robot(description, self.joints, friction, floats=floats, wheels=wheels)
        self.owner = self.robot.owner
        self.links = self.robot.links
        self.base_link = self.links[-1]
        of_joints = self._set_losses(description, lossless, kinematics)
        self._motors = BodyMotors(self.robot, len(self.joints), kinematics, motors=motors, friction=of_joints)
        self._followers = Followers(self.joints, description.mimics)
        self._follows = bool(self._followers)
        self._set_gears()
        self._base = base = FloatingBase(self.robot, kinematics.base)
        self.floating = base.floats
        self.position = base.position
        self.orientation = base.orientation
        self.linear = base.linear
        self.angular = base.angular
        self.place(np.zeros(len(self.joints)))

    def place(
        self,
        joints: Sequence[float] | np.ndarray,
        position: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
        orientation: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0, 1.0),
    ) -> None:
        """Put the robot somewhere at rest: joint positions [rad], pose of the base link's origin in the world."""
        self.robot.place_joints(joints)
        self._base.place(position, orientation)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the corners of a box in world axes around all shapes, shape (3,) each [m]."""
        return self.robot.box_around()

    def distance(self, others: Sequence[int]) -> float:
        """Compute the distance to the nearest of other bodies [m]; negative in an overlap, infinity without any."""
        for reach in SEARCH_DISTANCES:
            found = [point.distance for other in others for point in self.robot.closest_points(other, reach)]
            if found:
                return min(found)
        return math.inf

    def near(self, other: int, reach: float) -> np.ndarray:
        """Find the points on the body that are not farther than `reach` [m] from another one, shape (n, 3) [m]."""
        return np.array([point.position for point in self.robot.closest_points(other, reach)]).reshape(-1, 3)

    def center_of_mass(self) -> np.ndarray:
        """Compute the centre of mass of the whole body in the world, shape (3,) [m]."""
        return self.robot.center_of_mass()

    def overlap(self, others: Sequence[int]) -> tuple[float, str]:
        """Compute how deep a link that moves is inside of other bodies [m], and which one; 0 and "" without overlap."""
        deepest = 0.0, ""
        for name in self.links[:-1]:
            for other in others:
                points = self.robot.closest_points(other, 0.0, name)
                deepest = max([deepest, *((-point.distance, name) for point in points)])
        return deepest

    def set_friction(self, link: str, coefficient: float) -> None:
        """Change the friction coefficient of a link, and of all that is fixed to it."""
        self.robot.set_friction(link, coefficient)

    def read(self, q: np.ndarray, v: np.ndarray, motor_torque: np.ndarray) -> None:
        """Write the model's positions and velocities, shape (model size,), and the torques of the motors [Nm]."""
        position = q[self._first :]
        velocity = v[self._first :]
        self.robot.read_joints(position, velocity, self._motors.measured)
        if self._follows:
            self._follow(position, velocity)
        if self._motors.rows:
            self._motors.read(motor_torque)
        self._base.read(q, v)

    def apply(self, torque: np.ndarray, speed: np.ndarray) -> None:
        """Set what the next step does: torques of the model's DoFs, shape (model size,); speeds of the motors."""
        self._motors.apply(torque, speed)

    def change_drive(self, joint: str, state: DriveState) -> None:
        """Break the drive of a joint, or repair it; one on a torque is without power besides where it is free."""
        self._motors.change(self.joints.index(joint), state)

    @property
    def broken_drives(self) -> tuple[str, ...]:
        """Joints whose drives are not sound."""
        states = zip(self.joints, self._motors.states, strict=True)
        return tuple(joint for joint, state in states if state != "sound")

    def push_motors(self) -> None:
        """Let `apply` set torques of joints with motors, too: those act beside what a motor needs to hold its speed."""
        self._motors.push()

    def mass(self) -> float:
        """Sum up the mass of the whole body as the engine has it [kg]."""
        return self.robot.mass()

    def _follow(self, q: np.ndarray, v: np.ndarray) -> None:
        """Write what followers do by their leaders, and put them there: a gear holds speeds, and drifts slowly."""
        self._followers.follow(q, v)
        for joint in self._followers.dofs:
            self.robot.place_joint(int(joint), q[joint], v[joint])

    def _set_gears(self) -> None:
        """Connect each joint that follows another one with it by a gear: v_f - r v_l = 0."""
        for joint, leader, ratio in zip(
            self._followers.dofs, self._followers.leaders, self._followers.ratios, strict=True
        ):
            self.robot.add_gear(int(joint), int(leader), ratio)

    def _set_losses(self, description: Description, lossless: Collection[str], kinematics: Kinematics) -> list[float]:
        """Set the damping and the friction of the joints; return the friction."""
        joints = [None if name in lossless else description.joints[name] for name in self.joints]
        friction = [joint.friction if joint else 0.0 for joint in joints]
        self.robot.set_losses(
            [joint.damping if joint else 0.0 for joint in joints],
            friction,
            free_inertia(kinematics, neutral_posture(kinematics))[self._first :],
        )
        return friction
