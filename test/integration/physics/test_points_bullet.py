"""Points against PyBullet: positions, orientations and velocities of all links, and the centre of mass."""

import tempfile
from contextlib import closing
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet
import pybullet_data
import pytest
from numpy.testing import assert_allclose
from pybullet_utils.bullet_client import BulletClient

from solfer import Robot
from solfer.points import FrameOrientation, Handler, LinearPoint, SpatialVelocity

DATA = Path(pybullet_data.getDataPath())
ROBOTS = {
    "centauro": (Path(__file__).parents[3] / "config/robots/centauro/centauro.urdf", None),
    "a1": (DATA / "a1/a1.urdf", True),
    "kuka": (DATA / "kuka_iiwa/model.urdf", None),
}
STATES = 100


class PlacedRobot:
    """A robot in PyBullet, placed by its joints and the pose and twist of its base."""

    def __init__(self, robot: Robot):
        self._robot, self._client = robot, BulletClient(pybullet.DIRECT)
        floating = robot.kinematics.base is not None
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(without_shapes_and_floating_joint(robot))
            file.flush()
            flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MAINTAIN_LINK_ORDER
            self.id = self._client.loadURDF(file.name, useFixedBase=not floating, flags=flags)
        count = self._client.getNumJoints(self.id)
        infos = [self._client.getJointInfo(self.id, index) for index in range(count)]
        self.links = [info[12].decode() for info in infos]
        self._joints = [(info[0], robot.dof(info[1].decode())) for info in infos if info[2] != pybullet.JOINT_FIXED]

    def put(self, position: np.ndarray, velocity: np.ndarray) -> None:
        kinematics = self._robot.kinematics
        for index, dof in self._joints:
            self._client.resetJointState(self.id, index, position[dof], velocity[dof])
        if kinematics.base is not None:
            # PyBullet places a floating base by its centre of mass, and takes the velocity of that
            link = kinematics.base_link
            center, turn = self._client.getDynamicsInfo(self.id, -1)[3:5]
            place, quaternion = kinematics.base.to_pose(position[:6])
            pose = self._client.multiplyTransforms(place, quaternion, center, turn)
            linear, angular = kinematics.base.twist_from_rates(position[:6], velocity[:6])
            arm = LinearPoint(link, self._robot, center)
            arm.update(jacobian=False)
            linear = linear + np.cross(angular, arm.value - place)
            self._client.resetBasePositionAndOrientation(self.id, *pose)
            self._client.resetBaseVelocity(self.id, linear, angular)

    def close(self) -> None:
        self._client.disconnect()

    def link(self, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position and quaternion of the link's frame; velocity of the link's origin, then angular velocity."""
        # PyBullet's velocity is that of the centre of mass
        state = self._client.getLinkState(self.id, index, computeLinkVelocity=1, computeForwardKinematics=1)
        center, position, quaternion = np.array(state[0]), np.array(state[4]), np.array(state[5])
        linear, angular = np.array(state[6]), np.array(state[7])
        return position, quaternion, np.concatenate((linear + np.cross(angular, position - center), angular))


def without_shapes_and_floating_joint(robot: Robot) -> str:
    """Write the URDF of the links that move, below the link that the base moves."""
    tree = ElementTree.fromstring(robot.description.text)
    floating = robot.description.floating
    for link in tree.findall("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
        if floating is not None and link.get("name") == floating.parent:
            tree.remove(link)
    for joint in tree.findall("joint"):
        if joint.get("type") == "floating":
            tree.remove(joint)
    return ElementTree.tostring(tree, encoding="unicode")


@pytest.mark.daily(1)
@pytest.mark.parametrize("name", ROBOTS)
def test_links_move_as_in_pybullet(name):
    urdf, floating_base = ROBOTS[name]
    robot = Robot.load(urdf, floating_base=floating_base)
    with closing(PlacedRobot(robot)) as bullet:
        compare(robot, bullet)


def compare(robot: Robot, bullet: PlacedRobot) -> None:
    random = np.random.default_rng(11)
    positions = Handler(LinearPoint(link, robot) for link in bullet.links)
    orientations = Handler(FrameOrientation(link, robot) for link in bullet.links)
    velocities = Handler(SpatialVelocity(link, robot) for link in bullet.links)
    for _ in range(STATES):
        position, velocity = random.uniform(-1.0, 1.0, (2, robot.size))
        robot.state.position, robot.state.velocity = position, velocity
        robot.update()
        bullet.put(position, velocity)
        for handler in (positions, orientations, velocities):
            handler.update()
        for index in range(len(bullet.links)):
            place, quaternion, twist = bullet.link(index)
            assert_allclose(positions[index].value, place, atol=1e-6)
            assert_allclose(orientations[index].difference(quaternion), np.zeros(3), atol=1e-6)
            assert_allclose(velocities[index].value, twist, atol=1e-6)
