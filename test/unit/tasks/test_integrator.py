"""References from velocities: ranges, speeds, wind-up, what is measured, and the example of the documentation."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.allocations import check_that_it_keeps_no_memory
from support.needs import pybullet_robot

from solfer import Robot
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.tasks import ReferenceIntegrator

PERIOD = 0.01  # [s]


@pytest.fixture
def arm():
    return Robot.load(pybullet_robot("kuka_iiwa/model.urdf"))


def blocks(repository):
    """Return the first two examples of the page: what is made once, and a cycle."""
    page = (repository / "docs/reference/tasks.md").read_text()
    return [compile(block, "tasks.md", "exec") for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL)[:2]]


@pytest.mark.slow
def test_the_documented_example_does_not_wind_up(repository, monkeypatch):
    """A plain sum would leave the limits by 0.5 rad in this minute; references that come back leave them at once."""
    monkeypatch.chdir(repository / "config/robots/centauro")
    once, cycle = blocks(repository)
    names = {}
    exec(once, names)
    robot, hierarchy, command = names["robot"], names["hierarchy"], names["robot"].command
    lower, upper, fastest = robot.lower_limits, robot.upper_limits, robot.upper_limits.velocity
    plain, longest = command.position.copy(), 0.0
    for _ in range(round(60.0 / names["period"])):
        before = command.position.copy()
        exec(cycle, names)
        plain += hierarchy.velocity * names["period"]
        longest = max(longest, (plain - upper.position).max(), (lower.position - plain).max())
        assert (command.position >= lower.position).all() and (command.position <= upper.position).all()
        assert (np.abs(command.position - before) <= names["period"] * fastest + 1e-12).all()
        robot.state.position[:] = command.position
    # what a plain sum of the same velocities does
    assert longest > 0.5
    assert np.linalg.norm(names["left"].error.value) < 1e-6
    # there is nothing to come back from
    at_end = np.flatnonzero((command.position == upper.position) & np.isfinite(upper.position))
    at_start = np.flatnonzero((command.position == lower.position) & np.isfinite(lower.position))
    assert len(at_end) + len(at_start) > 0
    back = np.zeros(robot.size)
    back[at_end], back[at_start] = -0.1, 0.1
    names["integrator"].update(back)
    assert (command.position[at_end] < upper.position[at_end]).all()
    assert (command.position[at_start] > lower.position[at_start]).all()


def test_velocities_add_up_to_positions(arm):
    integrator, velocity = ReferenceIntegrator(arm, PERIOD), np.linspace(-0.3, 0.3, 7)
    arm.state.position[:] = start = np.linspace(-0.2, 0.2, 7)
    integrator.start()
    assert_array_equal(arm.command.position, start)
    for count in range(1, 20):
        assert integrator.update(velocity) is arm.command.velocity
        assert_allclose(arm.command.position, start + count * PERIOD * velocity, atol=1e-12)
        assert_array_equal(arm.command.velocity, velocity)


def test_speeds_and_ranges_are_kept(arm):
    integrator, fastest = ReferenceIntegrator(arm, PERIOD), arm.upper_limits.velocity
    assert (fastest < 100.0).all()
    for sign, limits in ((1.0, arm.upper_limits), (-1.0, arm.lower_limits)):
        integrator.start()
        integrator.update(np.full(7, sign * 100.0))
        assert_allclose(arm.command.velocity, sign * fastest)
        assert_allclose(arm.command.position, sign * fastest * PERIOD)
        for _ in range(1000):
            integrator.update(np.full(7, sign * 100.0))
        assert_array_equal(arm.command.position, limits.position)
        assert_array_equal(arm.command.velocity, 0.0)
        integrator.update(np.full(7, -sign * 0.1))
        assert_allclose(arm.command.position, limits.position - sign * 0.1 * PERIOD)


def test_it_starts_at_rest_inside_the_ranges(arm):
    arm.state.position[:] = 0.1
    arm.state.position[1], arm.state.position[2] = 9.0, -9.0
    arm.command.velocity[:] = 3.0
    ReferenceIntegrator(arm, PERIOD).start()
    upper, lower = arm.upper_limits.position, arm.lower_limits.position
    assert_array_equal(arm.command.position, [0.1, upper[1], lower[2], 0.1, 0.1, 0.1, 0.1])
    assert_array_equal(arm.command.velocity, 0.0)


def test_bounds_may_be_narrower_and_look_ahead(arm):
    wide = np.full(7, 0.5)
    bounds = VelocityBounds(arm.dofs, -wide, wide, np.ones(7), 0.1)
    integrator = ReferenceIntegrator(arm, PERIOD, bounds)
    integrator.start()
    for _ in range(50):
        integrator.update(np.full(7, 1.0))
    # from 0.4 on a tenth of the way that is left in each cycle
    assert_allclose(arm.command.position, 0.5 - 0.1 * 0.9**10, atol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_reference_stays_near_the_measured_position(arm, sign):
    """Joints that are blocked or pushed back take their references along, no faster than their speed limit."""
    lead = np.full(7, 0.05)
    lead[6] = np.inf
    integrator = ReferenceIntegrator(arm, PERIOD, lead=lead)
    integrator.start()
    for _ in range(100):
        integrator.update(np.full(7, sign * 0.5))
    # the joints are held where they are
    assert_allclose(arm.command.position, sign * np.array([0.05] * 6 + [0.5]), atol=1e-12)
    assert_allclose(arm.command.velocity, sign * np.array([0.0] * 6 + [0.5]), atol=1e-9)
    # and are pushed back: references follow no faster than joints move
    arm.state.position[:] = -sign
    integrator.update(np.full(7, sign * 0.5))
    assert_allclose(arm.command.velocity[:6], -sign * arm.upper_limits.velocity[:6])
    for _ in range(200):
        integrator.update(np.full(7, sign * 0.5))
    assert_allclose(arm.command.position[:6], sign * (0.05 - 1.0), atol=1e-12)


def test_a_lead_of_infinity_is_none(arm):
    integrator = ReferenceIntegrator(arm, PERIOD, lead=np.full(7, np.inf))
    integrator.start()
    integrator.update(np.full(7, 0.5))
    assert_allclose(arm.command.position, 0.5 * PERIOD)


@pytest.mark.slow
def test_a_cycle_keeps_no_memory(arm):
    integrator, velocity = ReferenceIntegrator(arm, PERIOD, lead=0.1), np.full(7, 1e-3)
    integrator.start()
    check_that_it_keeps_no_memory(lambda: integrator.update(velocity))
