"""A robot that PyBullet has loaded."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from solfer.errors import SimulationError
from solfer.model.urdf.description import Description
from solfer.simulation.bullet.base import BulletBase
from solfer.simulation.bullet.client import STDERR, STDOUT, BulletClient, decimal_points, redirected
from solfer.simulation.bullet.differences import warn_of_differences
from solfer.simulation.loading.body_urdf import body_urdf
from solfer.simulation.loading.friction import coefficients
from solfer.simulation.loading.meshes import MeshReader
from solfer.simulation.physics import (
    STEP,
    ClosestPoint,
    ContactPoint,
    JointGroup,
    RobotInEngine,
    Vector,
)
from solfer.simulation.world.records import Friction

READER = MeshReader("PyBullet", ((".obj", rb"(?m)^\s*v\s"), (".dae", rb"<float_array\b")))


class BulletJoints(JointGroup):
    """Joints that are driven together, by PyBullet's numbers.

    Args:
        client: The world.
        body: Number of the body.
        indices: PyBullet's numbers of the joints.
    """

    def __init__(self, client: BulletClient, body: int, indices: Sequence[int]):
        self._set = client.bullet.setJointMotorControlArray
        self._torque_control = client.bullet.TORQUE_CONTROL
        self._velocity_control = client.bullet.VELOCITY_CONTROL
        self._body = body
        self._indices = list(indices)

    def apply_torques(self, torques: np.ndarray) -> None:
        """See `JointGroup.apply_torques`."""
        self._set(self._body, self._indices, self._torque_control, forces=torques.tolist())

    def hold_speeds(self, speeds: np.ndarray, efforts: tuple[float, ...]) -> None:
        """See `JointGroup.hold_speeds`."""
        self._set(self._body, self._indices, self._velocity_control, targetVelocities=speeds.tolist(), forces=efforts)


class BulletRobot(RobotInEngine):
    """A body of PyBullet. PyBullet's own order of joints and links stays inside.

    Args:
        client: The world.
        description: The robot.
        joints: Its moving joints, in the order in which they are read and driven.
        friction: Friction of its links.
        floats: Whether its base moves.

    Raises:
        SimulationError: PyBullet cannot load the robot, it has more than 127 joints, or `friction` names a link that it
            does not have.
    """

    def __init__(
        self,
        client: BulletClient,
        description: Description,
        joints: Sequence[str],
        friction: Friction,
        *,
        floats: bool,
    ):
        self._world = client
        self._bullet = client.bullet
        if len(joints) > 127:  # PyBullet measures the state of no more
            what = f"the robot has {len(joints)} moving joints, more than PyBullet can take"
            raise SimulationError(what, where=description.where, expected="at most 127")
        with tempfile.TemporaryDirectory() as folder:
            urdf = body_urdf(description, floats, Path(folder), reader=READER)
            self.owner = urdf.owner
            self.number = self._load(urdf.text, Path(folder, "robot.urdf"), description.where, floats=floats)
        self._name_links(urdf.base, joints)
        warn_of_differences(client, self.number, urdf.text, where=description.where)
        self._set_dynamics(friction, urdf.owner)
        self._base = BulletBase(client, self.number)

    def read_joints(self, position: np.ndarray, velocity: np.ndarray, effort: np.ndarray | None = None) -> None:
        """See `RobotInEngine.read_joints`."""
        states = self._bullet.getJointStates(self.number, self._indices)
        position[:], velocity[:], _, efforts = zip(*states, strict=True)
        if effort is not None:
            effort[:] = efforts

    def read_base(self, motion: np.ndarray) -> None:
        """See `RobotInEngine.read_base`."""
        self._base.read(motion)

    def place_joints(self, positions: Sequence[float] | np.ndarray) -> None:
        """See `RobotInEngine.place_joints`."""
        self._bullet.resetJointStatesMultiDof(
            self.number, self._indices, [[float(value)] for value in positions], [[0.0]] * len(self._indices)
        )

    def place_joint(self, joint: int, position: float, velocity: float) -> None:
        """See `RobotInEngine.place_joint`."""
        self._bullet.resetJointState(self.number, self._indices[joint], position, velocity)

    def place_base(self, position: Sequence[float] | np.ndarray, orientation: Sequence[float] | np.ndarray) -> None:
        """See `RobotInEngine.place_base`."""
        self._base.place(position, orientation)

    def group(self, joints: Sequence[int]) -> BulletJoints:
        """See `RobotInEngine.group`."""
        return BulletJoints(self._world, self.number, [self._indices[joint] for joint in joints])

    def set_losses(self, damping: Sequence[float], friction: Sequence[float], inertia: np.ndarray) -> None:
        """See `RobotInEngine.set_losses`; friction is that of motors, which hold the joints back.

        PyBullet takes the speed at the begin of a step for damping, which diverges where it would turn a joint back.
        """
        bounds = 0.25 * inertia / STEP  # damping takes at most a quarter of its speed from a joint in a step
        for index, value, bound in zip(self._indices, damping, bounds.tolist(), strict=True):
            if value:
                self._bullet.changeDynamics(self.number, index, jointDamping=min(value, bound))
        self._bullet.setJointMotorControlArray(
            self.number, self._indices, self._bullet.VELOCITY_CONTROL, forces=list(friction)
        )

    def add_gear(self, joint: int, leader: int, ratio: float) -> None:
        """See `RobotInEngine.add_gear`."""
        gear = self._bullet.createConstraint(
            self.number,
            self._indices[joint],
            self.number,
            self._indices[leader],
            self._bullet.JOINT_GEAR,
            (0.0, 1.0, 0.0),
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
        )
        self._bullet.changeConstraint(gear, gearRatio=-ratio, maxForce=1e6)

    def set_friction(self, link: str, coefficient: float) -> None:
        """See `RobotInEngine.set_friction`."""
        self._bullet.changeDynamics(self.number, self._numbers[self.owner[link]], lateralFriction=coefficient)

    def push(self, link: str, force: Sequence[float], torque: Sequence[float], position: Sequence[float]) -> None:
        """See `RobotInEngine.push`."""
        bullet = self._bullet
        index = self._numbers[self.owner[link]]
        bullet.applyExternalForce(self.number, index, force, position, bullet.WORLD_FRAME)
        bullet.applyExternalTorque(self.number, index, torque, bullet.WORLD_FRAME)

    def contacts(self) -> list[ContactPoint]:
        """See `RobotInEngine.contacts`."""
        found = self._bullet.getContactPoints(self.number)
        return [ContactPoint(self.links[point[3]], point[5], _force(point)) for point in found if point[9] > 0.0]

    def closest_points(self, body: int, reach: float, link: str | None = None) -> list[ClosestPoint]:
        """See `RobotInEngine.closest_points`."""
        only = () if link is None else (self._numbers[link],)
        found = self._bullet.getClosestPoints(self.number, body, reach, *only)
        return [ClosestPoint(point[5], point[8]) for point in found]

    def box_around(self) -> tuple[np.ndarray, np.ndarray]:
        """See `RobotInEngine.box_around`."""
        boxes = np.array([self._bullet.getAABB(self.number, index) for index in self._numbers.values()])
        return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)

    def center_of_mass(self) -> np.ndarray:
        """See `RobotInEngine.center_of_mass`."""
        bullet = self._bullet
        links = list(range(len(self.links) - 1))
        states = bullet.getLinkStates(self.number, links, computeForwardKinematics=1)
        places = [bullet.getBasePositionAndOrientation(self.number)[0], *(state[0] for state in states)]
        return np.average(places, axis=0, weights=self._masses())

    def mass(self) -> float:
        """See `RobotInEngine.mass`."""
        return sum(self._masses())

    def _masses(self) -> list[float]:
        """Read the masses of PyBullet's links, that of the base first [kg]."""
        return [self._bullet.getDynamicsInfo(self.number, index)[0] for index in self._numbers.values()]

    def _load(self, text: str, path: Path, where: str, floats: bool) -> int:
        bullet = self._bullet
        flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_IMPLICIT_CYLINDER
        path.write_text(text, encoding="utf-8")
        try:
            with redirected((STDOUT,), STDERR), decimal_points():
                return bullet.loadURDF(str(path), useFixedBase=not floats, flags=flags)
        except bullet.error as error:
            raise SimulationError(
                f"PyBullet cannot load the robot: {error}", where=where, expected="a URDF that PyBullet can load"
            ) from error

    def _name_links(self, base: str, joints: Sequence[str]) -> None:
        count = self._bullet.getNumJoints(self.number)
        infos = [self._bullet.getJointInfo(self.number, index) for index in range(count)]
        by_name = {info[1].decode(): info[0] for info in infos}
        self.links = (*(info[12].decode() for info in infos), base)  # the base is the last: -1 finds it
        self._numbers = {link: index - 1 for index, link in enumerate((base, *self.links[:-1]))}
        self._indices = [by_name[name] for name in joints]

    def _set_dynamics(self, friction: Friction, owner: Mapping[str, str]) -> None:
        of_links = coefficients(friction, owner)
        change = self._bullet.changeDynamics
        change(self.number, -1, linearDamping=0.0, angularDamping=0.0)
        # free light links reach Bullet's own default of 100 rad/s
        change(self.number, -1, maxJointVelocity=1000.0)
        for link, index in self._numbers.items():  # calls of their own: some values redirect a call to the base
            change(self.number, index, jointDamping=0.0)
            change(
                self.number,
                index,
                lateralFriction=of_links[link],
                rollingFriction=0.0,
                spinningFriction=0.0,
                restitution=0.0,
            )


def _force(point: tuple) -> Vector:
    """Add PyBullet's normal force along the normal and its friction along two lateral directions."""
    (nx, ny, nz), normal, lateral, (ax, ay, az), other, (bx, by, bz) = point[7], *point[9:14]
    return (
        normal * nx + lateral * ax + other * bx,
        normal * ny + lateral * ay + other * by,
        normal * nz + lateral * az + other * bz,
    )
