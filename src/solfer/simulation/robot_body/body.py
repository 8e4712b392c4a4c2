"""A robot in a PyBullet world: its state, its motors, and where it is put."""

import math
import tempfile
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.errors import SimulationError
from solfer.model.followers import Followers
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.numerics.rotations import quaternion_product, rotated
from solfer.simulation.robot_body.body_urdf import body_urdf
from solfer.simulation.robot_body.differences import warn_of_differences
from solfer.simulation.world.engine import STDERR, STDOUT, Engine, decimal_points, redirected
from solfer.simulation.world.records import Friction

LARGEST_SPEED = 1000.0  # [rad/s]; Bullet's own default of 100 is reached by free light links
LARGEST_EFFORT = 1e6  # [Nm], of motors without a limit
MOST_JOINTS = 127  # of which PyBullet measures the state
REACH = 100.0  # [m], how far away other bodies are searched for


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
        position, orientation: Pose of that link's origin in the world, shape (3,) [m] and (4,), (x, y, z, w).
        linear, angular: Velocity of its origin [m/s] and angular velocity [rad/s] in world axes, shape (3,) each.

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
        lossless: Collection[str] = (),
    ):
        self._engine = engine
        self._bullet = engine.bullet
        self._client = engine.client
        self._chart = kinematics.base
        self._first = 0 if self._chart is None else 6
        self.joints = tuple(kinematics.dofs[self._first :])
        if len(self.joints) > MOST_JOINTS:
            what = f"the robot has {len(self.joints)} moving joints, more than PyBullet can take"
            raise SimulationError(what, where=description.where, expected=f"at most {MOST_JOINTS}")
        motion = np.zeros(13)
        self.orientation, self.position, self.linear, self.angular = np.split(motion, (4, 7, 10))
        self.orientation[3] = 1.0
        if self._chart is not None:
            # imported here: its compiler takes a while to load
            from solfer.numerics.twist_transport import ORIENTED, POSE, TWIST, Carried

            at_base = np.concatenate((np.eye(3).ravel(), np.zeros(9)))
            self._in_chart = Carried(self._chart, motion, at_base)
            self._whole = ORIENTED | POSE | TWIST
        with tempfile.TemporaryDirectory() as folder:
            urdf = body_urdf(description, self._chart is not None, Path(folder))
            self.base_link = urdf.base
            self.owner = urdf.owner
            self.id = self._load(urdf.text, Path(folder, "robot.urdf"), description.where)
        self._name_links(urdf.base)
        warn_of_differences(engine, self.id, urdf.text, where=description.where)
        self._set_dynamics(friction, urdf.owner)
        self._set_losses(description, lossless)
        self._set_motors(kinematics, motors)
        self._followers = Followers(self.joints, description.mimics)
        self._follows = bool(self._followers)
        self._set_gears()
        self._to_com = tuple(self._bullet.getDynamicsInfo(self.id, -1, self._client)[3:5])
        # not by PyBullet's own functions of transforms, which compute with single precision
        x, y, z, w = self._to_com[1]
        self._turn_from_com = -x, -y, -z, w
        self._from_com = rotated([-each for each in self._to_com[0]], self._turn_from_com)
        self.place(np.zeros(len(self.joints)))

    def place(
        self,
        joints: Sequence[float] | np.ndarray,
        position: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
        orientation: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0, 1.0),
    ) -> None:
        """Put the robot somewhere at rest: joint positions [rad], pose of the base link's origin in the world."""
        bullet = self._bullet
        client = self._client
        bullet.resetJointStatesMultiDof(
            self.id,
            self._indices,
            [[float(value)] for value in joints],
            [[0.0]] * len(self._indices),
            physicsClientId=client,
        )
        if self._chart is not None:
            offset, turn = self._to_com
            com = np.add(position, rotated(offset, orientation)).tolist()
            bullet.resetBasePositionAndOrientation(self.id, com, quaternion_product(orientation, turn), client)
            bullet.resetBaseVelocity(self.id, [0.0] * 3, [0.0] * 3, client)

    @property
    def floating(self) -> bool:
        """Whether the base moves."""
        return self._chart is not None

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the corners of a box in world axes around all shapes, shape (3,) each [m]."""
        boxes = np.array([self._bullet.getAABB(self.id, link, self._client) for link in range(-1, len(self.links) - 1)])
        return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)

    def distance(self, others: Sequence[int]) -> float:
        """Compute the distance to the nearest of other bodies [m]; negative in an overlap, infinity without any."""
        found = (self._bullet.getClosestPoints(self.id, other, REACH, physicsClientId=self._client) for other in others)
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
        if self._follows:
            self._follow(q[self._first :], v[self._first :])
        if self._motor_rows:
            motor_torque[:] = [torques[row] for row in self._motor_rows]
        if self._chart is not None:
            self._read_base()
            self._in_chart.update(self._whole)
            q[:6], v[:6] = self._in_chart.base, self._in_chart.rates

    def apply(self, torque: np.ndarray, speed: np.ndarray) -> None:
        """Set what the next step does: torques of the model's DoFs, shape (model size,); speeds of the motors."""
        if self._torque_indices:
            self._bullet.setJointMotorControlArray(
                self.id,
                self._torque_indices,
                self._bullet.TORQUE_CONTROL,
                forces=torque[self._torque_dofs].tolist(),
                physicsClientId=self._client,
            )
        if self._motor_indices:
            self._bullet.setJointMotorControlArray(
                self.id,
                self._motor_indices,
                self._bullet.VELOCITY_CONTROL,
                targetVelocities=speed.tolist(),
                forces=self._motor_efforts,
                physicsClientId=self._client,
            )

    def push_motors(self) -> None:
        """Let `apply` set torques of joints with motors, too: those act beside what a motor needs to hold its speed."""
        self._torque_dofs = np.arange(self._first, self._first + len(self.joints))
        self._torque_indices = list(self._indices)

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

    def _read_base(self) -> None:
        """Read the base link; PyBullet has pose and velocity of the base's centre of mass, in its principal axes."""
        com, orientation = self._bullet.getBasePositionAndOrientation(self.id, self._client)
        (vx, vy, vz), (wx, wy, wz) = self._bullet.getBaseVelocity(self.id, self._client)
        x, y, z = rotated(self._from_com, orientation)  # from the centre of mass to the origin
        cx = -x
        cy = -y
        cz = -z
        self.position[:] = com[0] + x, com[1] + y, com[2] + z
        self.orientation[:] = quaternion_product(orientation, self._turn_from_com)
        self.linear[:] = vx - (wy * cz - wz * cy), vy - (wz * cx - wx * cz), vz - (wx * cy - wy * cx)
        self.angular[:] = wx, wy, wz

    def _load(self, text: str, path: Path, where: str) -> int:
        bullet = self._bullet
        flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_IMPLICIT_CYLINDER
        path.write_text(text, encoding="utf-8")
        try:
            with redirected((STDOUT,), STDERR), decimal_points():
                return bullet.loadURDF(
                    str(path), useFixedBase=self._chart is None, flags=flags, physicsClientId=self._client
                )
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

    def _set_losses(self, description: Description, lossless: Collection[str]) -> None:
        """Set the damping of the joints, and prepare their friction, which motors make that hold them back."""
        joints = [description.joints[name] for name in self.joints]
        self._losses = [0.0 if joint.name in lossless else joint.friction for joint in joints]
        for index, joint in zip(self._indices, joints, strict=True):
            if joint.damping and joint.name not in lossless:
                self._bullet.changeDynamics(self.id, index, jointDamping=joint.damping, physicsClientId=self._client)

    def _set_motors(self, kinematics: Kinematics, motors: np.ndarray) -> None:
        """Leave only friction to PyBullet's motors, which every joint starts with, except where a speed is held."""
        self._torque_dofs = np.array(
            [dof for dof in range(self._first, kinematics.size) if dof not in motors], dtype=np.intp
        )
        self._torque_indices = [self._indices[dof - self._first] for dof in self._torque_dofs]
        self._motor_rows = [int(dof) - self._first for dof in motors]
        self._motor_indices = [self._indices[row] for row in self._motor_rows]
        self._motor_efforts = np.minimum(kinematics.effort_limit[motors], LARGEST_EFFORT).tolist()
        self._bullet.setJointMotorControlArray(
            self.id,
            self._indices,
            self._bullet.VELOCITY_CONTROL,
            forces=self._losses,
            physicsClientId=self._client,
        )
