"""Torques that carry a robot on its contacts: against the original program, and against linear algebra of their own."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro

from solfer import Robot
from solfer.dynamics import CarryingTorques
from solfer.dynamics.carrying import WEAK
from solfer.points import Handler, PointContact
from solfer.points.contact.contact_constraint import ContactConstraint

TEST = Path(__file__).parents[2]
CENTAURO = TEST.parent / "config/robots/centauro"
BASE = np.arange(6)


@pytest.fixture
def robot():
    robot = centauro("mammal_wide_straight")
    random = np.random.default_rng(5)
    robot.state.position += random.uniform(-0.2, 0.2, robot.size)
    robot.state.velocity = random.uniform(-0.2, 0.2, robot.size)
    robot.update()
    return robot


def wheels(robot):
    """Return the constraints of the four wheels, each in its own frame."""
    return Handler(ContactConstraint(contact) for contact in robot.contacts.group("wheels"))


def rows_of(handler):
    handler.update()
    return handler.jacobian


def least_torques(robot, jacobian, free):
    """Solve for forces with the least torques that leave no load on the DoFs `free`, all forces at once."""
    bias, driven = robot.dynamics.bias, np.setdiff1d(np.arange(robot.size), free)
    rest, count = jacobian[:, driven], len(jacobian)
    system = np.block([[rest @ rest.T, jacobian[:, free]], [jacobian[:, free].T, np.zeros((len(free), len(free)))]])
    forces = np.linalg.solve(system, np.concatenate([rest @ bias[driven], bias[free]]))[:count]
    return bias - jacobian.T @ forces


def test_torques_are_those_of_the_original(robot):
    golden = json.loads(gzip.decompress((TEST / "data/gravity_compensation.json.gz").read_bytes()))
    order = [*range(6), *(golden["dof_names"].index(name) for name in robot.dofs[6:])]
    carrying, contacts = CarryingTorques(robot.dynamics, BASE), wheels(robot)
    for state in golden["states"]:
        robot.state.position, robot.state.velocity = np.array(state["q"])[order], np.array(state["qd"])[order]
        robot.update()
        assert_allclose(carrying.update(rows_of(contacts)), np.array(state["tau"])[order], rtol=0, atol=1e-6)
    assert len(golden["states"]) == 3 and carrying.carried == 6


def test_torques_on_four_wheels_are_the_least(robot):
    jacobian = rows_of(wheels(robot))
    torque = CarryingTorques(robot.dynamics, BASE).update(jacobian)
    assert_allclose(torque, least_torques(robot, jacobian, BASE), rtol=0, atol=1e-8)
    assert not torque[BASE].any()


def test_wheels_without_torque_leave_legs_to_carry(robot):
    free = np.union1d(BASE, robot.selectors["wheels"].indices)
    for leg, angle in ((1, 0.4), (2, -0.4), (3, 0.4), (4, -0.4)):  # that point to each other, and hold the robot well
        robot.state.position[robot.dofs.index(f"ankle_yaw_{leg}")] += angle
    robot.update()
    jacobian = rows_of(wheels(robot))
    carrying = CarryingTorques(robot.dynamics, free)
    assert_allclose(carrying.update(jacobian), least_torques(robot, jacobian, free), rtol=0, atol=1e-8)
    assert carrying.carried == len(free) and not carrying.torque[free].any()


def test_what_parallel_wheels_hold_weakly_fades(robot):
    free = np.union1d(BASE, robot.selectors["wheels"].indices)
    robot.state.position[BASE] = robot.state.velocity[:] = 0.0
    robot.update()
    jacobian, bias = rows_of(wheels(robot)), robot.dynamics.bias
    carrying = CarryingTorques(robot.dynamics, free)
    torque, span = carrying.update(jacobian), np.linalg.qr(jacobian.T)[0]
    held, along = span[free], span.T @ bias
    eigenvalues, vectors = np.linalg.eigh(held @ held.T)
    is_held = eigenvalues > WEAK
    ratios = np.where(is_held, 1.0 / eigenvalues, eigenvalues / WEAK**2)
    load = vectors @ (ratios * (vectors.T @ (bias[free] - held @ along)))
    expected = bias - span @ (along + held.T @ load)
    expected[free] = 0.0
    assert 6 <= carrying.carried == np.count_nonzero(is_held) < len(free)
    assert_allclose(torque, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("links", [("wheel_1",), ("ankle2_3",)])
def test_one_flat_foot_carries_all_of_it(robot, links):
    """Six rows leave one solution: forces of least norm that carry the base's rows."""
    feet = Handler(ContactConstraint(PointContact(link, robot, constraint=np.eye(6))) for link in links)
    jacobian, bias = rows_of(feet), robot.dynamics.bias
    forces = np.linalg.lstsq(jacobian[:, :6].T, bias[:6], rcond=None)[0]
    torque = CarryingTorques(robot.dynamics, BASE).update(jacobian)
    assert_allclose(torque, bias - jacobian.T @ forces, rtol=0, atol=1e-8)


def test_lifted_contacts_carry_nothing_until_they_return(robot):
    carrying, contacts = CarryingTorques(robot.dynamics, BASE), wheels(robot)
    before = carrying.update(rows_of(contacts)).copy()
    robot.contacts["front_left_leg"].active = False
    robot.contacts.update()
    jacobian = rows_of(contacts)
    three = least_torques(robot, jacobian[3:], BASE)
    assert not jacobian[:3].any() and carrying.rank == 12
    assert_allclose(carrying.update(jacobian), three, rtol=0, atol=1e-8)
    assert carrying.rank == 9 and np.abs(three - before).max() > 1.0
    robot.contacts["front_left_leg"].active = True
    robot.contacts.update()
    assert_allclose(carrying.update(rows_of(contacts)), before, rtol=0, atol=1e-10)


@pytest.mark.parametrize("noise", [0.0, 1e-14])
def test_rows_that_repeat_others_change_nothing(robot, noise):
    jacobian = rows_of(wheels(robot))
    expected = CarryingTorques(robot.dynamics, BASE).update(jacobian).copy()
    again = jacobian[:6] + noise * np.random.default_rng(2).normal(size=(6, robot.size))
    carrying = CarryingTorques(robot.dynamics, BASE)
    torque = carrying.update(np.concatenate([jacobian, 2.0 * again]))
    assert_allclose(torque, expected, rtol=0, atol=1e-8)
    assert carrying.rank == 12


def test_a_row_behind_one_of_zeros_counts(robot):
    row = rows_of(wheels(robot))[2]
    alone, behind = (CarryingTorques(robot.dynamics, BASE) for _ in range(2))
    expected = alone.update(row[None].copy()).copy()
    assert_allclose(behind.update(np.stack([0.0 * row, row])), expected, rtol=0, atol=1e-9)
    assert alone.rank == behind.rank == 1


def test_what_is_not_finite_leaves_no_torque_unmarked(robot):
    jacobian = rows_of(wheels(robot)).copy()
    jacobian[4, 9] = np.nan
    assert np.isnan(CarryingTorques(robot.dynamics, BASE).update(jacobian)[6:]).any()


def test_nothing_to_stand_on_leaves_the_joints_loads(robot):
    torque = CarryingTorques(robot.dynamics, BASE).update(np.zeros((3, robot.size)))
    assert_allclose(torque[6:], robot.dynamics.bias[6:], rtol=0, atol=0)
    assert not torque[:6].any()


def test_a_line_of_contacts_asks_for_no_huge_torques(robot):
    """Nobody can stand on a line: what turns about it is left, and the rest is carried."""
    contacts = Handler(PointContact(f"wheel_{leg}", robot) for leg in (1, 4))
    carrying = CarryingTorques(robot.dynamics, BASE)
    torque = carrying.update(rows_of(contacts))
    assert carrying.carried == 5 and np.abs(torque).max() < 1000.0
    forces = np.linalg.lstsq(contacts.jacobian.T, robot.dynamics.bias - torque, rcond=None)[0]
    left = (robot.dynamics.bias - torque - contacts.jacobian.T @ forces)[:3]
    assert np.abs(left).max() < 50.0  # of 930 N
    bias, span = robot.dynamics.bias, np.linalg.qr(contacts.jacobian.T)[0]
    held = np.linalg.pinv(span[BASE], rcond=1e-3)  # without what turns about the line
    along = span.T @ bias
    expected = bias - span @ (along + held @ (bias[BASE] - span[BASE] @ along))
    assert_allclose(torque[6:], expected[6:], rtol=0, atol=1e-6)


def test_wheels_that_come_to_roll_the_same_way_are_not_pressed_against_each_other(robot):
    """They hold the robot the less, the nearer they are to it: the forces across them would have to be huge."""
    random = np.random.default_rng(1)
    indices, values = robot.named_state("mammal_wide_straight")
    carrying = CarryingTorques(robot.dynamics, np.union1d(BASE, robot.selectors["wheels"].indices))
    for _ in range(100):
        robot.state.position[:] = 0.0
        robot.state.position[indices] = values
        robot.state.position[6:] += random.uniform(-0.1, 0.1, robot.size - 6)
        robot.state.velocity[:] = random.uniform(-3.0, 3.0, robot.size)
        apart = 10.0 ** random.uniform(-4.0, -1.0)
        for leg, sign in ((1, 1.0), (2, -1.0), (3, 1.0), (4, -1.0)):
            yaw = robot.dofs.index(f"ankle_yaw_{leg}")
            robot.state.position[yaw] = values[indices == yaw][0] + sign * apart
        robot.update()
        assert np.abs(carrying.update(rows_of(wheels(robot)))).max() < 150.0


def test_a_robot_on_a_fixed_base_needs_no_contacts():
    robot = Robot.load(CENTAURO / "centauro.urdf", floating_base=False)
    robot.update()
    torque = CarryingTorques(robot.dynamics, np.zeros(0, dtype=int)).update(np.zeros((0, robot.size)))
    assert_allclose(torque, robot.dynamics.bias, rtol=0, atol=0)
