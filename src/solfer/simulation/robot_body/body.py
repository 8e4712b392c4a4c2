"""A robot in a PyBullet world: its state, its motors, and where it is put."""

import math
import tempfile
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.errors import SimulationError
from solfer.lower_level.gains.defaults import free_inertia
from solfer.model.followers import Followers
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture
from solfer.model.urdf.description import Description
from solfer.simulation.robot_body.base import FloatingBase
from solfer.simulation.robot_body.body_urdf import body_urdf
from solfer.simulation.robot_body.differences import warn_of_differences
from solfer.simulation.robot_body.motors import LARGEST_EFFORT, BodyMotors
from solfer.simulation.world.engine import STDERR_DESCRIPTOR, STDOUT, STEP, Engine, decimal_points, redirected
from solfer.simulation.world.records import Friction

LARGEST_SPEED = 1000.0  # [rad/s]; Bullet's own default of 100 is reached by free light links
MOST_BRAKING = 0.25  # share of its speed that the damping of the description takes from a joint in a step
MOST_JOINTS = 127  # of which PyBullet measures the state
SEARCH_DISTANCE = 100.0  # [m], how far away other bodies are searched for


class Body:
    """A robot in the world. Joints and DoFs have the model's order; PyBullet's own order stays inside.

    Args:
        engine: The world.
        description: The robot.
        kinematics: Its model; the body floats if the model has a floating base.
        motors: DoFs with motors that hold a speed; all other joints are driven by torques.
        friction: Friction of its links.
        lossless: Joints without the damping and friction of the description.

    Attributes:
        id: Number of the body.
        joints: Names of the joints.
        links: Name of each of PyBullet's links; the base is the last, so that index -1 finds it.
        owner: For each link of the description, the link of PyBullet's that it became part of.
        base_link: Link that `position`, `orientation`, `linear` and `angular` belong to.

    Raises:
        SimulationError: PyBullet cannot load the robot, it has more than MOST_JOINTS joints, or `friction` names a link
            that it does not have.
    """

    def __init__(
        self,
        engine: Engine,
        description: Description,
        kinematics: Kinematics,
        motors: np.ndarray,
        friction: Friction,
        *,
        lossless: Collection[str] = (),
    ):
        self._bullet = engine.bullet
        self._client = engine.client
        floats = kinematics.base is not None
        self._first = 6 if floats else 0
        self.joints = tuple(kinematics.dofs[self._first :])
        if len(self.joints) > MOST_JOINTS:
            what = f"the robot has {len(self.joints)} moving joints, more than PyBullet can take"
            raise SimulationError(what, where=description.where, expected=f"at most {MOST_JOINTS}")
        with tempfile.TemporaryDirectory() as folder:
            urdf = body_urdf(description, floats, Path(folder))
            self.base_link = urdf.base
            self.owner = urdf.owner
            self.id = self._load(urdf.text, Path(folder, "robot.urdf"), description.where, floats=floats)
        self._name_links(urdf.base)
        warn_of_differences(engine, self.id, urdf.text, where=description.where)
        self._set_dynamics(friction, urdf.owner)
        losses = self._set_losses(description, lossless, kinematics)
        self._motors = BodyMotors(engine, self.id, self._indices, kinematics=kinematics, motors=motors, losses=losses)
        self._followers = Followers(self.joints, description.mimics)
        self._set_gears()
        self._base = FloatingBase(engine, self.id, kinematics.base)
        self.place(np.zeros(len(self.joints)))

    def place(
        self,
        joints: Sequence[float] | np.ndarray,
        position: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
        orientation: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0, 1.0),
    ) -> None:
        """Put the robot somewhere at rest: joint positions [rad], pose of the base link's origin in the world."""
        self._bullet.resetJointStatesMultiDof(
            self.id,
            self._indices,
            [[float(value)] for value in joints],
            [[0.0]] * len(self._indices),
            physicsClientId=self._client,
        )
        self._base.place(position, orientation)

    @property
    def floating(self) -> bool:
        """Whether the base moves."""
        return self._base.floats

    @property
    def position(self) -> np.ndarray:
        """Position of the base link's origin in the world, shape (3,) [m]; live."""
        return self._base.position

    @property
    def orientation(self) -> np.ndarray:
        """Orientation of the base link, shape (4,), (x, y, z, w); live."""
        return self._base.orientation

    @property
    def linear(self) -> np.ndarray:
        """Velocity of its origin in world axes, shape (3,) [m/s]; live."""
        return self._base.linear

    @property
    def angular(self) -> np.ndarray:
        """Angular velocity of the base link in world axes, shape (3,) [rad/s]; live."""
        return self._base.angular

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the corners of a box in world axes around all shapes, shape (3,) each [m]."""
        boxes = np.array([self._bullet.getAABB(self.id, link, self._client) for link in range(-1, len(self.links) - 1)])
        return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)

    def distance(self, others: Sequence[int]) -> float:
        """Compute the distance to the nearest of other bodies [m]; negative in an overlap, infinity without any."""
        found = (
            self._bullet.getClosestPoints(self.id, other, SEARCH_DISTANCE, physicsClientId=self._client)
            for other in others
        )
        return min((point[8] for points in found for point in points), default=math.inf)

    def near(self, other: int, reach: float) -> np.ndarray:
        """Find the points on the body that are not farther than `reach` [m] from another one, shape (n, 3) [m]."""
        found = self._bullet.getClosestPoints(self.id, other, reach, physicsClientId=self._client)
        return np.array([point[5] for point in found]).reshape(-1, 3)

    def center_of_mass(self) -> np.ndarray:
        """Compute the centre of mass of the whole body in the world, shape (3,) [m]."""
        bullet = self._bullet
        client = self._client
        links = list(range(len(self.links) - 1))
        states = bullet.getLinkStates(self.id, links, computeForwardKinematics=1, physicsClientId=client)
        places = [bullet.getBasePositionAndOrientation(self.id, client)[0], *(state[0] for state in states)]
        return np.average(places, axis=0, weights=self._masses())

    def overlap(self, others: Sequence[int]) -> tuple[float, str]:
        """Compute how deep a link that moves is inside of other bodies [m], and which one; 0 and "" without overlap."""
        deepest = 0.0, ""
        for link, name in enumerate(self.links[:-1]):
            for other in others:
                points = self._bullet.getClosestPoints(self.id, other, 0.0, link, physicsClientId=self._client)
                deepest = max([deepest, *((-point[8], name) for point in points)])
        return deepest

    def index(self, link: str) -> int:
        """Return PyBullet's number of the link that a link of the description became part of."""
        return self._numbers[self.owner[link]]

    def set_friction(self, link: str, coefficient: float) -> None:
        """Change the friction coefficient of a link, and of all that is fixed to it."""
        self._bullet.changeDynamics(
            self.id, self.index(link), lateralFriction=coefficient, physicsClientId=self._client
        )

    def read(self, q: np.ndarray, v: np.ndarray, motor_torque: np.ndarray) -> None:
        """Write the model's positions and velocities, shape (model size,), and the torques of the motors [Nm]."""
        states = self._bullet.getJointStates(self.id, self._indices, self._client)
        q[self._first :], v[self._first :], _, torques = zip(*states, strict=True)
        if self._followers:
            self._follow(q[self._first :], v[self._first :])
        if self._motors.rows:
            motor_torque[:] = [torques[row] for row in self._motors.rows]
        self._base.read(q, v)

    def apply(self, torque: np.ndarray, speed: np.ndarray) -> None:
        """Set what the next step does: torques of the model's DoFs, shape (model size,); speeds of the motors."""
        self._motors.apply(torque, speed)

    def push_motors(self) -> None:
        """Let `apply` set torques of joints with motors, too: those act beside what a motor needs to hold its speed."""
        self._motors.push()

    def mass(self) -> float:
        """Sum up the mass of the whole body as PyBullet has it [kg]."""
        return sum(self._masses())

    def _masses(self) -> list[float]:
        """Read the masses of PyBullet's links, that of the base first [kg]."""
        links = range(-1, len(self.links) - 1)
        return [self._bullet.getDynamicsInfo(self.id, link, self._client)[0] for link in links]

    def _follow(self, q: np.ndarray, v: np.ndarray) -> None:
        """Write what followers do by their leaders, and put them there: a gear holds speeds, and drifts slowly."""
        self._followers.follow(q, v)
        for joint in self._followers.dofs:
            self._bullet.resetJointState(
                self.id, self._indices[joint], q[joint], v[joint], physicsClientId=self._client
            )

    def _set_gears(self) -> None:
        """Connect each joint that follows another one with it by a gear: v_f - r v_l = 0."""
        for joint, leader, ratio in zip(
            self._followers.dofs, self._followers.leaders, self._followers.ratios, strict=True
        ):
            gear = self._bullet.createConstraint(
                self.id,
                self._indices[joint],
                self.id,
                self._indices[leader],
                self._bullet.JOINT_GEAR,
                (0.0, 1.0, 0.0),
                (0.0, 0.0, 0.0),
                (0.0, 0.0, 0.0),
                physicsClientId=self._client,
            )
            self._bullet.changeConstraint(gear, gearRatio=-ratio, maxForce=LARGEST_EFFORT, physicsClientId=self._client)

    def _load(self, text: str, path: Path, where: str, floats: bool) -> int:
        bullet = self._bullet
        flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_IMPLICIT_CYLINDER
        path.write_text(text, encoding="utf-8")
        try:
            with redirected((STDOUT,), STDERR_DESCRIPTOR), decimal_points():
                return bullet.loadURDF(str(path), useFixedBase=not floats, flags=flags, physicsClientId=self._client)
        except bullet.error as error:
            raise SimulationError(
                f"PyBullet cannot load the robot: {error}", where=where, expected="a URDF that PyBullet can load"
            ) from error

    def _name_links(self, base: str) -> None:
        count = self._bullet.getNumJoints(self.id, self._client)
        infos = [self._bullet.getJointInfo(self.id, index, self._client) for index in range(count)]
        by_name = {info[1].decode(): info[0] for info in infos}
        self.links = (*(info[12].decode() for info in infos), base)
        self._numbers = {link: index - 1 for index, link in enumerate((base, *self.links[:-1]))}
        self._indices = [by_name[name] for name in self.joints]

    def _set_dynamics(self, friction: Friction, owner: Mapping[str, str]) -> None:
        unknown = [link for link in friction.links if link not in owner]
        if unknown:
            raise SimulationError(
                f"friction of links that the robot does not have: {', '.join(unknown)}",
                expected="links that the URDF of the robot has",
            )
        coefficients = {owner[link]: value for link, value in friction.links.items()}
        change = self._bullet.changeDynamics
        client = self._client
        change(self.id, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
        change(self.id, -1, maxJointVelocity=LARGEST_SPEED, physicsClientId=client)
        for index in range(-1, len(self.links) - 1):  # calls of their own: some values redirect a call to the base
            change(self.id, index, jointDamping=0.0, physicsClientId=client)
            change(
                self.id,
                index,
                lateralFriction=coefficients.get(self.links[index], friction.default),
                rollingFriction=0.0,
                spinningFriction=0.0,
                restitution=0.0,
                physicsClientId=client,
            )

    def _set_losses(self, description: Description, lossless: Collection[str], kinematics: Kinematics) -> list[float]:
        """Set the damping of the joints; return their friction, which motors make that hold them back [Nm].

        PyBullet takes the speed at the begin of a step for damping, which diverges where it would turn a joint back.
        """
        joints = [description.joints[name] for name in self.joints]
        most = MOST_BRAKING * free_inertia(kinematics, neutral_posture(kinematics))[self._first :] / STEP
        for index, joint, bound in zip(self._indices, joints, most.tolist(), strict=True):
            if joint.damping and joint.name not in lossless:
                damping = min(joint.damping, bound)
                self._bullet.changeDynamics(self.id, index, jointDamping=damping, physicsClientId=self._client)
        return [0.0 if joint.name in lossless else joint.friction for joint in joints]
