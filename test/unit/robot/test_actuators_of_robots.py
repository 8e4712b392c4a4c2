"""Actuators of a Robot: which DoFs have a drive, limits of their torques, rotors in its dynamics."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from solfer import Robot
from solfer.model import Actuators, Description, Kinematics
from solfer.tasks.constraints import TorqueLimits

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
SPRING = {"type": "SEA", "Ks": 9e3, "D": 1.0, "B": 1.0, "phim": 2e-5, "nu": 100.0, "Torque_limit": 20.0}


def load(folder, **actuators):
    """Load CENTAURO with these actuators alone."""
    file = folder / "actuators.yaml"
    file.write_text(json.dumps({"centauro": {"actuators": actuators}}))
    robot = Robot.load(CENTAURO / "centauro.urdf", actuators=file, name="centauro")
    robot.state.position[:] = np.random.default_rng(2).uniform(-0.5, 0.5, robot.size)
    robot.state.velocity[:] = np.random.default_rng(3).uniform(-0.5, 0.5, robot.size)
    robot.update()
    return robot


def test_joints_without_a_drive_are_not_actuated(tmp_path):
    robot = load(tmp_path, torso_yaw=SPRING, neck_yaw={"type": "UNACTUATED"}, j_wheel_2=SPRING)
    assert [robot.dofs[dof] for dof in robot.actuated] == sorted(("j_wheel_2", "torso_yaw"), key=robot.dofs.index)
    assert_array_equal(robot.maps["ACTUATED"].robot_indices, robot.actuated)
    assert robot.actuators.types[robot.dof("neck_yaw")] == "UNACTUATED"


@pytest.mark.parametrize("actuators", [None, CENTAURO / "actuators.yaml"])
def test_every_joint_of_centauro_has_a_drive(actuators):
    robot = Robot.load(CENTAURO / "centauro.urdf", actuators=actuators, name="centauro")
    assert_array_equal(robot.actuated, np.arange(6, 48))
    assert robot.actuators.passive == robot.dofs[:6]


def test_torque_limits_are_those_of_the_actuators(tmp_path):
    robot, plain = load(tmp_path, torso_yaw=SPRING), Robot.load(CENTAURO / "centauro.urdf")
    torso, other = robot.dof("torso_yaw"), robot.dof("j_wheel_2")
    for one, limit in ((robot, 20.0), (plain, 147.0)):
        assert one.upper_limits.torque[torso] == limit == -one.lower_limits.torque[torso]
        assert one.upper_limits.torque[other] == 35.0
    bounds = TorqueLimits(robot.dynamics, 0.01), TorqueLimits(plain.dynamics, 0.01)
    plain.state.position[:], plain.state.velocity[:] = robot.state.position, robot.state.velocity
    plain.update()
    for one in bounds:
        one.update()
    width = [one.upper - one.lower for one in bounds]
    assert width[0][torso - 6] / width[1][torso - 6] == pytest.approx(20.0 / 147.0)
    assert width[0][other - 6] == pytest.approx(width[1][other - 6])


def test_rotors_count_in_inertia_and_inverse(tmp_path):
    plain = load(tmp_path, torso_yaw=SPRING, j_wheel_2=SPRING)
    robot = load(tmp_path, torso_yaw=SPRING | {"reflect_inertia": True}, j_wheel_2=SPRING)
    expected = plain.dynamics.inertia.copy()
    expected[robot.dof("torso_yaw"), robot.dof("torso_yaw")] += 0.2
    for _ in range(2):  # the rotor counts once, however often it is computed
        assert_allclose(robot.dynamics.inertia, expected, atol=1e-12)
        robot.state.position[0] += 0.1
        robot.update()
    assert_allclose(robot.dynamics.inertia_inverse, np.linalg.inv(expected), atol=1e-7)
    assert_allclose(robot.dynamics.bias, plain.dynamics.bias, atol=1e-9)
    found = robot.kinematics.inertia(robot.state.position)  # by Pinocchio
    assert_allclose(np.triu(found), np.triu(expected), atol=1e-9)


def test_a_simulated_link_moves_without_rotors():
    kinematics = Kinematics(Description.from_file(CENTAURO / "centauro.urdf"))
    before = kinematics.inertia(np.zeros(48)).copy()
    actuators = Actuators.from_file(CENTAURO / "actuators.yaml", "centauro", kinematics.dofs)
    kinematics.drive(actuators, rotors=False)
    assert_array_equal(kinematics.inertia(np.zeros(48)), before)
