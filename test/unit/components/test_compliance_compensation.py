"""The component `compliance_compensation` on CENTAURO: where the motors have to be for the links to be in place."""

import numpy as np
import pytest
from support.robots import centauro

from solfer.components.compliance_compensation import ComplianceCompensation, ComplianceTags
from solfer.errors import ComponentError

CYCLES = 120_000


def started(robot, **tags):
    component = ComplianceCompensation(robot, ComplianceTags(**tags))
    component.set_rate(200.0)
    component.init()
    return component


def cycle(component, count=1):
    for _ in range(count):
        component.update()
        component.send()
    return component.model.command.position


@pytest.fixture
def robot():
    robot = centauro(actuators=True)
    random = np.random.default_rng(3)
    robot.state.position[:] = random.uniform(-0.5, 0.5, robot.size)
    robot.command.torque[:] = random.uniform(-50.0, 50.0, robot.size)
    return robot


def test_motors_lead_by_the_deflection_of_springs(robot):
    component, desired = started(robot), np.random.default_rng(4).uniform(-1.0, 1.0, robot.size)
    robot.command.write("position", desired)
    torque, springs = robot.command.torque, robot.actuators.stiffness
    motors = cycle(component)
    carried = springs * (motors - desired)
    assert np.abs(carried - torque)[6:].max() < 1e-9 and np.array_equal(motors[:6], desired[:6])


@pytest.mark.slow
def test_a_constant_reference_never_drifts(robot):
    component = started(robot)
    first = cycle(component).copy()
    assert np.abs(first - robot.state.position)[6:].min() > 0.0
    assert np.abs(cycle(component, CYCLES) - first).max() <= 1e-6


def test_a_new_reference_counts_for_its_joints_alone(robot):
    component = started(robot)
    before = cycle(component, 3).copy()
    robot.command.write("position", np.array([0.25]), np.array([20]))
    after = cycle(component, 3)
    assert after[20] == 0.25 + robot.command.torque[20] / robot.actuators.stiffness[20]
    assert np.array_equal(np.delete(after, 20), np.delete(before, 20))


def test_other_joints_than_the_chain_are_left(robot):
    component = started(robot, chain="left_arm")
    arm = robot.selectors["left_arm"].indices
    moved = np.flatnonzero(cycle(component) != robot.state.position)
    assert np.array_equal(moved, arm)


def test_a_start_is_where_the_links_are(robot):
    component = started(robot)
    cycle(component, 5)
    robot.state.position += 0.1
    component.init()
    deflection = robot.command.torque[6:] / robot.actuators.stiffness[6:]
    assert np.abs(cycle(component)[6:] - robot.state.position[6:] - deflection).max() < 1e-12


def test_a_chain_without_springs_is_refused():
    with pytest.raises(ComponentError, match=r"actuators: \{read: true\}"):
        ComplianceCompensation(centauro(), ComplianceTags(chain="arms"))


def test_without_springs_nothing_is_compensated(caplog):
    component = ComplianceCompensation(centauro())
    component.init()
    component.model.command.torque[:] = 20.0
    assert np.array_equal(cycle(component), component.model.state.position)
    assert "nothing is compensated" in caplog.text
