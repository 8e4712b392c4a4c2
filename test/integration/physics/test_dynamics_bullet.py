"""Dynamics against PyBullet's own, and against the balance of energy and momentum over a second of motion."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet
import pybullet_data
import pytest
from numpy.testing import assert_allclose
from pybullet_utils.bullet_client import BulletClient

from solfer import Robot
from solfer.dynamics import DynamicModel
from solfer.model.urdf.scalar_joints import scalar_joints

ROOT, DATA = Path(__file__).parents[3], Path(pybullet_data.getDataPath())
ROBOTS = {
    "centauro": (ROOT / "config/robots/centauro/centauro.urdf", None),
    "a1": (DATA / "a1/a1.urdf", True),
    "kuka": (DATA / "kuka_iiwa/model.urdf", None),
}
NOTHING = ElementTree.fromstring(
    '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def load(name: str) -> Robot:
    path, floating_base = ROBOTS[name]
    return Robot.load(path, floating_base=floating_base)


@pytest.fixture(params=ROBOTS)
def pair(request, tmp_path):
    """Load a Robot, the same robot in PyBullet with its base on six joints, and the order of PyBullet's joints."""
    robot = load(request.param)
    tree = ElementTree.fromstring(scalar_joints(robot.description, ROBOTS[request.param][1]))
    for link in tree.findall("link"):
        if link.find("inertial") is None:
            link.append(NOTHING)  # PyBullet would give it a mass of 1 kg
    path = tmp_path / "robot.urdf"
    path.write_bytes(ElementTree.tostring(tree))
    bullet = BulletClient(pybullet.DIRECT)
    body = bullet.loadURDF(str(path), useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
    bullet.setGravity(0.0, 0.0, -9.81)
    joints = [bullet.getJointInfo(body, index) for index in range(bullet.getNumJoints(body))]
    moving = (pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC)
    order = [robot.dof(joint[1].decode()) for joint in joints if joint[2] in moving]
    yield robot, bullet, body, order
    bullet.disconnect()


def test_inverse_dynamics_and_inertia_are_those_of_pybullet(pair):
    robot, bullet, body, order = pair
    model, random = DynamicModel(robot), np.random.default_rng(6)
    assert sorted(order) == list(range(robot.size))
    for _ in range(100):
        position, velocity, acceleration = random.uniform(-1.0, 1.0, (3, robot.size))
        robot.state.position, robot.state.velocity = position, velocity
        model.update()
        effort = model.inertia @ acceleration + model.bias
        state = (list(values[order]) for values in (position, velocity, acceleration))
        expected = np.array(bullet.calculateInverseDynamics(body, *state))
        assert_allclose(effort[order], expected, rtol=0.0, atol=1e-7 * np.abs(expected).max())
        expected = np.array(bullet.calculateMassMatrix(body, list(position[order])))
        assert_allclose(model.inertia[np.ix_(order, order)], expected, rtol=0.0, atol=1e-7 * np.abs(expected).max())


def potential_energy(robot: Robot) -> float:
    """[J], above the height zero."""
    return -robot.kinematics.mass * robot.gravity @ robot.center_of_mass.value


def fall(robot: Robot, model: DynamicModel, effort: np.ndarray, seconds: float, step: float):
    """Move the robot by M a + h = effort, integrated by Runge and Kutta's method with a fixed step [s]."""

    def rate(state):
        robot.state.position, robot.state.velocity = state
        model.update()
        return np.array([state[1], model.inertia_inverse @ (effort - model.bias)])

    state = np.array([robot.state.position, robot.state.velocity])
    for _ in range(round(seconds / step)):
        first = rate(state)
        second = rate(state + 0.5 * step * first)
        third = rate(state + 0.5 * step * second)
        state = state + step / 6.0 * (first + 2.0 * second + 2.0 * third + rate(state + step * third))
    robot.state.position, robot.state.velocity = state
    model.update()


@pytest.mark.parametrize("name", ROBOTS)
def test_energy_is_kept_over_a_second_without_effort(name):
    """In free fall kinetic and potential energy exchange, with a sum that drifts by a millionth of that at most."""
    robot = load(name)
    model, random = DynamicModel(robot), np.random.default_rng(7)
    robot.state.position = random.uniform(-0.3, 0.3, robot.size)
    robot.state.velocity = random.uniform(-0.1, 0.1, robot.size)

    def energy():
        model.update()
        return 0.5 * robot.state.velocity @ model.inertia @ robot.state.velocity, potential_energy(robot)

    before = energy()
    fall(robot, model, np.zeros(robot.size), 1.0, 5e-4)
    after = energy()
    exchanged = abs(after[0] - before[0])
    assert exchanged > 0.01
    assert abs(sum(after) - sum(before)) < 1e-6 * exchanged


@pytest.mark.parametrize("name", ["centauro", "a1"])
def test_only_gravity_changes_the_momentum(name):
    robot = load(name)
    model, random = DynamicModel(robot), np.random.default_rng(8)
    robot.state.position = random.uniform(-0.3, 0.3, robot.size)
    effort = random.uniform(-0.1, 0.1, robot.size)
    effort[:6] = 0.0  # nothing holds the base

    def momentum():
        model.update()
        return robot.kinematics.mass * robot.kinematics.center_of_mass_jacobian @ robot.state.velocity

    before = momentum()
    fall(robot, model, effort, 1.0, 1e-3)
    expected = before + robot.kinematics.mass * robot.gravity
    assert_allclose(momentum(), expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())
