"""Section 1.1 of the paper, statement by statement: what a Robot describes, holds and maps."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from solfer import Robot
from solfer.model import BidirectionalMap, UnidirectionalMap
from solfer.points import Handler, Point

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
STATES = ("state", "motor", "command", "lower_limits", "upper_limits")


@pytest.fixture
def robot():
    robot = Robot.load(
        CENTAURO / "centauro.urdf",
        CENTAURO / "centauro.srdf",
        actuators=CENTAURO / "actuators.yaml",
        contacts=CENTAURO / "contacts.yaml",
    )
    robot.update()
    return robot


def test_the_description_has_actuation_gravity_and_size(robot):
    assert robot.size == len(robot.dofs) == robot.state.size == 48
    assert robot.dofs[:6] == ("x", "y", "z", "rx", "ry", "rz")
    assert_array_equal(robot.gravity, (0.0, 0.0, -9.81))
    assert [robot.dofs[dof] for dof in robot.actuated] == list(robot.dofs[6:]) == list(robot.actuators.names)


def test_links_joints_state_and_actuators_lead_to_each_other(robot):
    joint = robot.description.link("arm1_4").parent
    assert robot.description.joint(joint).child == "arm1_4"
    dof = robot.dof(joint)
    assert robot.dofs[dof] == joint
    assert robot.actuators[joint].stiffness == robot.actuators.stiffness[dof] > 0.0
    before, above = robot.kinematics.rotation("arm1_4").copy(), robot.kinematics.rotation("arm1_3").copy()
    robot.state.position[dof] += 0.5
    robot.update()
    turn = before.T @ robot.kinematics.rotation("arm1_4")
    assert np.arccos(0.5 * (np.trace(turn) - 1.0)) == pytest.approx(0.5)
    assert_allclose(robot.kinematics.rotation("arm1_3"), above, atol=1e-12)


@pytest.mark.parametrize("name", STATES)
def test_every_joint_space_state_has_its_interfaces_and_takes_more(robot, name):
    state = getattr(robot, name)
    assert state.interfaces == ("position", "velocity", "acceleration", "torque")
    assert all(state[interface].shape == (48,) for interface in state.interfaces)
    stiffness = state.add("stiffness", 48)
    state["stiffness"] = np.arange(48.0)
    assert_array_equal(stiffness, np.arange(48.0))
    assert "stiffness" not in getattr(robot, STATES[STATES.index(name) - 1])


def test_robot_points_describe_the_robot_as_a_whole(robot):
    assert isinstance(robot.center_of_mass, Point) and isinstance(robot.center_of_pressure, Point)
    assert isinstance(robot.contacts, Handler)
    robot.contacts.forces[:4] = 0.0, 0.0, 0.25 * 9.81 * robot.kinematics.mass
    middle = robot.contacts.positions[:4].mean(axis=0)
    assert_allclose(robot.center_of_pressure.value[:2], middle[:2], atol=1e-12)
    assert abs(robot.center_of_mass.value[1]) < 0.01


def test_maps_are_made_with_the_robot_and_added_online(robot):
    values = np.arange(48.0)
    assert_array_equal(robot.maps["RBDL"].to_external(values, np.zeros(48)), values)
    assert_array_equal(robot.maps["ACTUATED"].to_external(values, np.zeros(42)), values[6:])
    robot.maps.add(BidirectionalMap("mine", robot.dofs, ("torso_yaw", "z")))
    assert_array_equal(robot.maps["mine"].to_external(values, np.zeros(2)), (robot.dof("torso_yaw"), 2.0))
    assert_array_equal(robot.maps["mine"].to_robot(np.array((7.0, 8.0)), np.zeros(48))[[2]], (8.0,))


def test_groups_are_selected_and_added_online(robot):
    assert {name for name in robot.selectors} == {"all", *robot.semantics.groups}
    assert robot.selectors["wheels"].names == tuple(f"j_wheel_{leg}" for leg in (1, 2, 3, 4))
    robot.selectors.add(UnidirectionalMap("head", robot.dofs, ("neck_yaw",)))
    assert_array_equal(robot.selectors["head"].indices, (robot.dof("neck_yaw"),))
