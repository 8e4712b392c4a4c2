"""The component `wheeled_motion` on CENTAURO as it stood when the original was recorded."""

import json

import pytest
from support.robots import centauro
from support.unit.declarations import named

from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load
from solfer.interfaces.geometry import Twist, Vector

RATE = 200.0  # [Hz]
LOWER = 30  # DoFs of the lower body and the base


@pytest.fixture
def recorded(repository):
    return json.loads((repository / "test/data/original_wheels.json").read_text())


@pytest.fixture
def robot(recorded):
    robot = centauro()
    robot.state.position[:] = recorded["q0"]
    robot.update()
    return robot


@pytest.fixture
def make(repository, robot):
    """Make the component of the shipped configuration with other tags, at its start."""

    def make(**tags):
        record = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
        component = WheeledMotion(robot, record.model_copy(update=tags).placed_as(record), "wheels")
        component.set_rate(RATE)
        component.init()
        return component

    return make


def move(component, x, y, turn):
    """Send a velocity of the base [m/s], [rad/s]."""
    named(component.topics(), "cmd_vel").handler(Twist(Vector(x, y), Vector(0.0, 0.0, turn)))


def cycle(component, count=1, velocity=None):
    """Run cycles in which the robot does what is commanded; `cmd_vel` comes at 20 Hz."""
    robot = component.model
    for index in range(count):
        if velocity is not None and index % 10 == 0:
            move(component, *velocity)
        robot.update()
        component.update()
        component.send()
        robot.state.position[:LOWER] = robot.command.position[:LOWER]
        robot.state.velocity[:LOWER] = robot.command.velocity[:LOWER]
