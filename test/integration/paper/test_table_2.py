"""Table 2 of the paper: every pipe of the RT layer is made from configuration alone; the truth is that of PyBullet."""

import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from support.integration.bridged import BridgedWorld
from support.integration.world import ROBOT
from support.paper.table_1 import MemorySystem
from support.paper.table_2 import GOALS
from support.table_1 import ELBOW, HAND, KNEE_SPRING, PUSH, STILL, WHEEL_JOINTS, WHEELS

from solfer.components.move_joints import MoveJoints
from solfer.config import load
from solfer.middleware.bridge import Bridge
from solfer.numerics.rotations import quaternion_from_rotation

FILE = Path(__file__).parents[2] / "data" / "table_2.yaml"
TORQUE = 10.0  # [Nm]
YAW_SPRING = 5000.0
"""Stiffness of the joint torso_yaw in the lower level [Nm/rad]."""

HIGHER = "mammal_wide_high"
"""Named state in which the robot stands on longer legs than in its first one."""


class LayerSystem(MemorySystem):
    """`speaker` and `listener` in the RT layer, `outside` at the other end of the bridge.

    Args:
        folder: Where the shared memory is.
    """

    def __init__(self, folder):
        layer = [load(FILE, name, middleware="XBOT") for name in ("speaker", "listener")]
        super().__init__(BridgedWorld(folder, layer), FILE)
        self.outside = self.world.outside("outside", FILE)
        self.world.run(1.0)

    def ask(self, **request):
        """See `Table1System.ask`; the request goes over the bridge."""
        reply = self.world.bus.call("speaker/trajectory", MoveJoints(**request))
        self.world.run(0.02)
        assert reply.result(0).success, reply.result(0).message
        return reply.result(0).duration


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    made = LayerSystem(tmp_path_factory.mktemp("shared"))
    yield made
    made.world.close()


def of(robot, array, *joints):
    """Numbers of some joints of a Robot."""
    return array[[robot.dof(joint) for joint in joints]]


def published_joints(system, robot):
    """Return the positions that a Robot has received and those of the simulation [rad], of all joints."""
    joints = [robot.dofs[dof] for dof in robot.actuated]
    assert len(joints) == 42
    return robot.state.position[robot.actuated], [system.joint(joint)[0] for joint in joints]


def load_gains(world, folder, factor):
    """Let a node in shared memory ask the position controller for stiffer springs."""
    tree = yaml.safe_load((ROBOT / "gains.yaml").read_text())
    for gain in tree["centauro"]["gains"].values():
        gain["stiffness"] *= factor
    file = folder / f"gains_{factor:g}.yaml"
    file.write_text(yaml.safe_dump(tree))
    world.simulation.lower_level.folders.add(folder)
    reply = world.bus.call("position_controller/load_gains", file=str(file))
    while not reply.done():  # a thread reads the file
        time.sleep(0.01)
        world.run(Bridge.PERIOD)
    assert reply.result(0).success, reply.result(0).message


def test_table_2_row_1_desired_to_lower_level(system):
    """Desired positions and velocities reach the joints; those of torques are in the next test."""
    world = system.world
    world.run(system.ask(joints=("torso_yaw", "j_arm1_4"), positions=(0.2, -1.3), speed=1.0) + 0.5)
    assert_allclose([system.joint("torso_yaw")[0], system.joint("j_arm1_4")[0]], (0.2, -1.3), atol=0.02)
    speeds = (1.0, -1.0, 1.0, -1.0)
    system.ask(joints=WHEEL_JOINTS, velocities=speeds)
    world.run(1.0)
    assert_allclose([system.joint(wheel)[1] for wheel in WHEEL_JOINTS], speeds, atol=0.05)
    system.ask(joints=WHEEL_JOINTS, velocities=(0.0,) * 4)
    world.run(1.0)


@pytest.mark.parametrize("factor", [1.0, pytest.param(2.0, marks=pytest.mark.soak)])
def test_torque_of_row_1_turns_the_torso(system, tmp_path, factor):
    """A torque turns the joint against its spring, one that is twice as stiff by half as much."""
    world, command, yaw = system.world, system.speaker.robot.command, system.speaker.robot.dof("torso_yaw")
    if factor > 1.0:
        load_gains(world, tmp_path, factor)
        world.run(1.0)
    world.run(2.0)  # the torso settles slowly
    before = system.joint("torso_yaw")[0]
    command.torque[yaw] = TORQUE
    world.run(3.0)
    assert_allclose(system.joint("torso_yaw")[0] - before, TORQUE / YAW_SPRING / factor, rtol=0.05)
    command.torque[yaw] = 0.0
    world.run(0.2)


@pytest.mark.soak
def test_stiffness_of_row_1_bends_an_arm(system):
    gains = system.world.simulation.lower_level.controllers["position_controller"]
    before = gains.stiffness.copy()
    own = system.spring.robot.command["stiffness"].copy()
    system.sag(ELBOW, 300.0)
    changed = [joint for joint, now, old in zip(gains.joints, gains.stiffness, before, strict=True) if now != old]
    assert changed == [ELBOW]
    system.spring.robot.command["stiffness"] = own
    system.check_sag()


def test_table_2_row_2_state_from_lower_level(system):
    robot, loaded = system.speaker.robot, ("knee_pitch_1", "knee_pitch_3")
    published, expected = published_joints(system, robot)
    assert_allclose(published, expected, atol=STILL)
    torque = of(robot, robot.state.torque, *loaded)
    assert np.abs(torque).min() > 10.0  # it stands
    # seen behind the gear, a spring of a series elastic joint carries the torque of the joint
    deflection = of(robot, robot.motor.position, *loaded) - of(robot, robot.state.position, *loaded)
    assert_allclose(deflection, torque / KNEE_SPRING, rtol=0.05)


def test_table_2_row_3_imu(system):
    state = system.listener.robot.semantics.states[HIGHER]
    left = {
        joint: position
        for joint, position in state.items()
        if joint.startswith(("hip", "knee", "ankle")) and joint.endswith(("_1", "_3"))
    }
    system.world.run(system.ask(joints=tuple(left), positions=tuple(left.values())) + 1.0)
    position, orientation = system.pose("pelvis")
    robot = system.listener.robot
    published = quaternion_from_rotation(robot.kinematics.rotation("pelvis"))
    assert 2.0 * np.arccos(abs(orientation[3])) > 0.05  # it leans over
    assert 2.0 * np.arccos(min(1.0, abs(np.dot(published, orientation)))) < STILL
    assert np.linalg.norm(position) > 0.5 and not robot.state.position[:3].any()  # an IMU knows no place
    assert_allclose(robot.state.velocity[3:6], 0.0, atol=0.01)


def test_table_2_row_4_joints_between_plugins(system):
    goal = 0.2 if system.joint("neck_pitch")[0] < 0.1 else 0.0
    system.world.run(system.ask(joints=("neck_pitch",), positions=(goal,)) + 1.0)
    published, expected = published_joints(system, system.listener.robot)
    assert_allclose(published, expected, atol=STILL)
    assert_allclose(of(system.listener.robot, system.listener.robot.state.position, "neck_pitch"), goal, atol=0.02)


def test_table_2_row_5_points_between_plugins(system):
    inputs = system.listener.component.inputs
    position, orientation = system.pose(HAND)
    assert_allclose(inputs["hand"].value[:3], position, atol=STILL)
    assert abs(np.dot(inputs["hand"].value[3:], orientation)) > np.cos(STILL)
    assert_allclose(inputs["wheels"].value, [system.pose(wheel)[0] for wheel in WHEELS], atol=STILL)
    assert_allclose(inputs["push"].value, PUSH, atol=1e-12)


def test_table_2_row_6_rigid_body_outwards(system):
    position, orientation = system.pose("pelvis")
    kinematics = system.outside.robot.kinematics
    assert_allclose(kinematics.position("pelvis"), position, atol=STILL)
    assert abs(np.dot(quaternion_from_rotation(kinematics.rotation("pelvis")), orientation)) > np.cos(STILL)


def test_table_2_row_7_joint_state_inwards(system):
    received, published = system.listener.robot, system.outside.robot
    for sign in (1.0, -1.0):
        published.command.position[published.actuated] = sign * np.linspace(-1.0, 1.0, 42)
        published.command.velocity[published.actuated] = sign * np.linspace(2.0, 3.0, 42)
        system.world.run(0.05)
        for field in ("position", "velocity"):
            np.testing.assert_array_equal(
                received.command[field][received.actuated], published.command[field][published.actuated]
            )


def test_table_2_row_8_joint_state_outwards(system):
    published, expected = published_joints(system, system.outside.robot)
    assert_allclose(published, expected, atol=STILL)
    crossing = system.world.bridge.crossings["told/joints"]
    passed, dropped = crossing.passed, crossing.dropped
    system.world.run(1.0)
    assert crossing.passed - passed == 200  # forwarded at 200 Hz, and published at 500 Hz
    assert crossing.dropped - dropped == pytest.approx(300, abs=2)


def test_points_from_the_outside(system):
    for shift in (0.0, 0.5):
        system.outside.component.outputs["goals"].value[:] = GOALS + shift
        system.world.run(0.05)
        np.testing.assert_array_equal(system.listener.component.inputs["goals"].value, GOALS + shift)
    crossing = system.world.bridge.crossings["told/goals"]
    assert crossing.passed > 0 and crossing.refused == 0
