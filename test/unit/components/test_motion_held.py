"""The component `wheeled_motion` where motions cannot go on: they slow down, and rest before wheels slip or it tips."""

import json
import logging
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro

from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load

LOWER = 30  # DoFs of the lower body and the base


@pytest.fixture
def make(repository):
    """Make the component of the shipped configuration with other tags, on a robot of its own, at its start."""
    robot = centauro()
    robot.state.position[:] = json.loads((repository / "test/data/original_wheels.json").read_text())["q0"]
    robot.update()

    def make(**tags):
        record = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
        changed = {"base": "center_of_mass", **tags}
        component = WheeledMotion(robot, record.model_copy(update=changed).placed_as(record), "wheels")
        component.set_rate(200.0)
        component.init()
        return component

    return make


def cycle(component, count):
    """Run cycles in which the robot does as commanded; return how fast material at contacts moved at most [m/s]."""
    robot, sliding = component.model, 0.0
    for _ in range(count):
        robot.update()
        component.update()
        component.send()
        sliding = max(sliding, abs(component.stack.jacobian[:12] @ component.joints.velocity).max())
        robot.state.position[:LOWER], robot.state.velocity[:LOWER] = (
            robot.command.position[:LOWER],
            robot.command.velocity[:LOWER],
        )
    return sliding


NONE = np.zeros((4, 3))
INWARD = np.array([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tags", "vertices", "up", "reason"),
    [
        ({"support_margin": 0.25}, INWARD, 0.0, "inside the support polygon"),
        ({}, -INWARD, 0.0, "rad off"),
        ({}, NONE, 1.0, "near a singularity"),
    ],
    ids=["support", "tilt", "legs"],
)
def test_a_motion_holds_before_its_bound(make, caplog, tags, vertices, up, reason):
    """Support, tilt and singular legs each stop the motion without slip, give their reason, and allow the way back."""
    component = make(**tags)
    references, start = component.references, component.references.position.copy()
    references.vertex_velocity[:], references.velocity[2] = 0.1 * vertices, 0.1 * up
    with caplog.at_level(logging.WARNING):
        sliding, speeds = cycle(component, 2400), []
        for _ in range(600):
            sliding = max(sliding, cycle(component, 1))
            speeds.append(abs(component.joints.velocity).max())
    # every second it tries to go on
    assert references.pace < 0.05 and np.median(speeds) < 0.1
    assert sliding < 2e-3
    assert reason in caplog.text
    assert component._guard.margin > 0.03
    center = component.wheels.points["base"].value[3:5]
    assert_allclose(center, start[:2], atol=5e-3)
    references.vertex_velocity[:] *= -1.0
    references.velocity[2] *= -1.0  # back again
    cycle(component, 600)
    assert references.pace > 0.5 and abs(component.wheels.offsets.errors[:, :2]).max() < 8e-3


def test_speeds_that_jump_are_limited(make):
    component = make()
    references, before = component.references, component.references.vertices.copy()
    references.vertex_velocity[:, 1] = (2.0, -2.0, 2.0, -2.0)
    sliding, errors = 0.0, []
    for _ in range(40):
        sliding = max(sliding, cycle(component, 10))
        errors.append(abs(component.wheels.offsets.errors[:, :2]).max())
    way = abs(references.vertices - before).max()
    assert 0.05 < way <= 0.2 + 1e-9  # 0.1 m/s for 2 s
    assert max(errors) < 6e-3 and sliding < 1e-3


def test_a_wheel_keeps_the_way_it_began(make):
    """The aim flickers around the end of its range: turning back and forth would stop the robot for ever."""
    component, index = make(), 2
    dof, bounds, side = component.wheels.steering[index], component.tasks.bounds, math.radians(80.0)
    start, row = component.model.state.position[dof], component.tasks.rows["STEERING"].start + index
    turn = math.copysign(1.0, component.stack.jacobian[row, dof])
    # the end of its range is where it is to turn to, a little less or a little more
    bounds.lower_position[dof] = start - (side if turn < 0.0 else math.radians(130.0))
    bounds.upper_position[dof] = start + (side if turn > 0.0 else math.radians(130.0))
    for count in range(60):
        angle = side + math.radians(2.0 if count % 2 else -2.0)
        component.references.velocity[:2] = 0.1 * math.cos(angle), 0.1 * math.sin(angle)
        cycle(component, 5)
    steering = component._steering
    away = steering.aims[index] - steering.measured[index] + component.wheels.offsets.heading
    assert abs(math.sin(away)) < 0.1 and component.references.pace > 0.3


def test_wheels_turn_with_their_directions(make):
    component, angle, paces, bound = make(), 0.0, [], 0
    references = component.references
    for _ in range(2000):
        references.velocity[:2] = 0.15 * math.cos(angle), 0.15 * math.sin(angle)
        cycle(component, 1)
        angle += 0.8 * 0.005 * references.pace
        paces.append(references.pace)
        bound += component.tasks.descent.last >= 0
    assert min(paces[200:400]) > 0.95  # they do not lag behind
    # at the ends of their ranges they go on the other way round
    assert angle > 4.5 and min(paces[400:]) < 0.2
    assert bound == 0 and component._guard.why == ""
    assert abs(component.wheels.offsets.errors[:, :2]).max() < 5e-3


def test_wheels_turn_round_where_joints_are_late(make):
    component = make()
    robot, references, turning = component.model, component.references, component.wheels.steering
    angle, paces = 0.0, []
    for _ in range(2400):
        references.velocity[:2] = 0.15 * math.cos(angle), 0.15 * math.sin(angle)
        late = robot.state.position[turning].copy()
        cycle(component, 1)
        robot.state.position[turning] = late + 0.08 * (robot.command.position[turning] - late)  # 60 ms
        angle += 0.4 * 0.005 * references.pace
        paces.append(references.pace)
    assert angle > 3.0  # the ends of the ranges are behind it
    standing = "".join(" " if pace > 0.3 else "x" for pace in paces).split()
    assert max(map(len, standing)) < 400  # nowhere it hunts between two ways


def test_a_way_begins_where_its_joint_is_measured(make):
    component = make()
    component.model.update()
    component.stack.update_jacobian()
    dof, steered = component.wheels.steering[0], component._steering.steered
    row = component.stack.jacobian[component.tasks.rows["STEERING"].start, dof]
    end = component.tasks.bounds.upper_position[dof]
    way = 0.52 / row  # beyond the end of the range, but not from its commanded position
    component.model.state.position[dof], component.joints.position[dof] = end - 0.5, end - 0.55
    steered[0] = steered[3]
    steered[0, 0] += way
    component.tasks.find_errors(False)
    assert (component.tasks.aims[0] - steered[3, 0]) * way < 0.0  # the other way round
