"""`wheeled_motion`, compiled, against plain Python and NumPy along courses: limits, singular legs, lifted wheels."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.allocations import check_that_it_keeps_no_memory
from support.unit.slow_wheels import SlowWheels

from solfer import Robot
from solfer.components.geometry import Vector
from solfer.components.gravity_compensation import LiftContacts
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.drive import Twist, WheelsState
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import load

CLOSE, CLOSE_RATES = 1e-9, 1e-8  # [rad, m], [rad/s, m/s]


@pytest.fixture
def make(repository):
    """Make a component of the shipped configuration with other tags, on a Robot of its own, at its start."""
    folder = repository / "config/robots/centauro"
    shipped = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)

    def make(kind, **tags):
        robot = Robot.load(folder / "centauro.urdf", folder / "centauro.srdf", contacts=folder / "contacts.yaml")
        robot.state.position[:] = json.loads((repository / "test/data/original_wheels.json").read_text())["q0"]
        robot.update()
        component = kind(robot, shipped.model_copy(update={"pace": False, **tags}).placed_as(shipped), "wheels")
        component.set_rate(200.0)
        component.init()
        return component

    return make


def drive(component, cycle, course):
    """Let messages come, and the robot do what it is told."""
    robot, references = component.model, component.references
    if cycle % 10 == 0 and course != "rests":
        component.drive.receive(Twist(Vector(0.1, 0.03 if cycle < 60 else -0.1), Vector(0.0, 0.0, 0.2)))
        velocity = (0.0, -0.02, 0.0, 0.0, 0.02, 0.0) * 2
        component.targets.receive(WheelsSupport(velocity=velocity), references)
    if cycle == 40 and course == "lifted":
        component.services()[0].handler(LiftContacts(("rear_left_leg",), True))
    if course == "singular":
        references.velocity[2] = 0.3  # legs are stretched
    robot.update()
    component.update()
    component.send()
    moved = component.moved
    robot.state.position[moved], robot.state.velocity[moved] = (
        robot.command.position[moved],
        robot.command.velocity[moved],
    )
    return robot.command.position, robot.command.velocity


@pytest.mark.parametrize(
    ("course", "tags"),
    [
        ("drives", {}),
        ("drives", {"base": "center_of_mass", "prompt": False}),
        ("drives", {"faithful": True}),
        ("drives", {"across": 0.0, "feed_forward": False}),
        ("rests", {"across": 0.0}),
        ("lifted", {"base": "center_of_mass"}),
        ("singular", {}),
        ("slow joints", {}),
        ("short ranges", {}),
    ],
)
def test_the_compiled_way_gives_equal_numbers(make, course, tags):
    compiled, slow = make(WheeledMotion, **tags), make(SlowWheels, **tags)
    scales, counts = [1.0], [0]
    for component in (compiled, slow):
        bounds, start = component._bounds, component.model.state.position[6]
        if course == "slow joints":
            bounds.speed[10:30:6], bounds.speed[11:30:6] = 0.4, 1.0
        if course == "short ranges":
            bounds.lower_position[6], bounds.upper_position[6] = start - 0.05, start + 0.05
            component._name_parts()
        if course == "rests":
            component.references.vertices[:, 1] += 3e-3
    for cycle in range(120):
        found, expected = (drive(component, cycle, course) for component in (compiled, slow))
        for (one, other), close in zip(zip(found, expected, strict=True), (CLOSE, CLOSE_RATES), strict=True):
            assert_allclose(one, other, atol=close, rtol=0.0, err_msg=str(cycle))
        scales.append(compiled._descent.scale)
        counts.append(compiled._descent.count)
    assert (min(scales) < 0.9) == (course == "slow joints")
    assert (max(counts) > 0) == (course == "short ranges")


def test_a_cycle_of_driving_keeps_no_memory(make):
    component = make(WheeledMotion, pace=True)
    robot, references = component.model, component.references
    references.velocity[:2], references.vertex_velocity[:, 1] = (0.02, 0.01), (0.001, -0.001) * 2

    def cycle():
        robot.update()
        component.update()
        component.send()
        robot.state.position[:] = robot.command.position

    check_that_it_keeps_no_memory(cycle)


def test_the_pace_is_told(make):
    component = make(WheeledMotion, pace=True)
    _, state, _, told = component.topics()
    assert told.collect().data == 1.0 and told.collect() is None  # at the beginning, then where it changes
    heard = []
    for cycle in range(500):
        state.handler(WheelsState(y=1.0))
        drive(component, cycle, "rests")
        heard.append(told.collect())
    spoken = [cycle for cycle, message in enumerate(heard) if message is not None]
    assert max(np.diff(spoken)) <= 20  # 0.1 s
    assert min(heard[cycle].data for cycle in spoken) < 0.1  # wheels turn
    assert heard[spoken[-1]].data == pytest.approx(0.5 * component.references.pace, abs=0.02)  # half is `base_speed`
    assert component.references.pace > 0.5
