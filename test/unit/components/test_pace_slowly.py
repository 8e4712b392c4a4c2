"""Pace, references and guard of `wheeled_motion`, compiled, against plain Python."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.slow_guard import WatchedWheels

from solfer import Robot
from solfer.components.geometry import Vector
from solfer.components.gravity_compensation import LiftContacts
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.drive import Twist
from solfer.config import load

INWARD = np.array([(0.0, -0.1, 0.0), (0.0, 0.1, 0.0), (0.0, -0.1, 0.0), (0.0, 0.1, 0.0)])

CYCLES = 1600


@pytest.fixture
def make(repository):
    """Make the component of the shipped configuration with other tags, watched, at its start."""
    folder = repository / "config/robots/centauro"

    def make(**tags):
        robot = Robot.load(folder / "centauro.urdf", folder / "centauro.srdf", contacts=folder / "contacts.yaml")
        robot.state.position[:] = json.loads((repository / "test/data/original_wheels.json").read_text())["q0"]
        robot.update()
        shipped = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
        record = shipped.model_copy(update={"base": "center_of_mass", **tags}).placed_as(shipped)
        component = WatchedWheels(robot, record, "wheels")
        component.set_rate(200.0)
        component.init()
        return component

    return make


def move(component, index, course):
    """Want what the course says."""
    references = component.references
    if course in ("messages", "lifted") and index % 10 == 0 and index < 600:
        component.drive.receive(Twist(Vector(0.2, 0.05 if index < 300 else -0.1), Vector(0.0, 0.0, 0.3)))
    if course == "lifted" and index == 50:
        component.services()[0].handler(LiftContacts(("rear_left_leg",), True))
    if course in ("inward", "outward"):
        speed = (20.0 if index > 100 else 1.0) * (-1.0 if index > 3 * CYCLES / 4 else 1.0)
        references.vertex_velocity[:] = (speed if course == "inward" else -speed) * INWARD
    if course == "up":
        references.velocity[2], references.turn[:2] = 0.1, (0.02, -0.03)


@pytest.mark.parametrize(
    ("course", "tags", "reasons"),
    [
        ("messages", {}, {""}),
        ("messages", {"base": "link"}, {""}),
        ("lifted", {}, {""}),
        ("inward", {"support_margin": 0.25}, {"m inside the support polygon"}),
        ("outward", {}, {"rad off"}),
        ("up", {}, {"near a singularity"}),
    ],
)
def test_the_compiled_pace_gives_equal_numbers(make, course, tags, reasons):
    component = make(**tags)
    robot, moved, found = component.model, component.moved, set()
    for index in range(CYCLES):
        move(component, index, course)
        robot.update()
        component.update()
        component.send()
        robot.state.position[moved], robot.state.velocity[moved] = (
            robot.command.position[moved],
            robot.command.velocity[moved],
        )
        for one, other in component.pairs:
            assert_allclose(one, other, atol=1e-12, rtol=1e-12, err_msg=f"{course}, cycle {index}")
        component.pairs.clear()
    found = {reason.lstrip("-.0123456789 ") for reason in component.reasons}
    assert reasons <= found
