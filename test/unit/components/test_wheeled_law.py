"""`wheeled_motion`, compiled, beside its law in plain NumPy: limits, singular legs, lifted wheels."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.allocations import check_that_it_keeps_no_memory
from support.estimation import part
from support.unit.declarations import named

from solfer import Robot
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.drive import WheelsState
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import load
from solfer.interfaces.geometry import Twist, Vector
from solfer.interfaces.support import LiftContacts


@pytest.fixture
def make(repository):
    """Make a component with other tags, speeds of ankles and wheels [rad/s], and room of the first joint [rad]."""
    folder = repository / "config/robots/centauro"
    shipped = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)

    def make(tags, speeds=None, room=None):
        robot = Robot.load(folder / "centauro.urdf", folder / "centauro.srdf", contacts=folder / "contacts.yaml")
        robot.state.position[:] = json.loads((repository / "test/data/original_wheels.json").read_text())["q0"]
        robot.update()
        kinematics, start = robot.kinematics, robot.state.position[6]
        if speeds is not None:
            kinematics.velocity_limit[10:30:6], kinematics.velocity_limit[11:30:6] = speeds
        if room is not None:
            kinematics.lower_position[6], kinematics.upper_position[6] = start - room, start + room
        component = WheeledMotion(
            robot, shipped.model_copy(update={"pace": False, **tags}).placed_as(shipped), "wheels"
        )
        component.set_rate(200.0)
        component.init()
        return component

    return make


def drive(component, cycle, course):
    """Receive messages as the course has them, and let the robot move as it is commanded."""
    robot, references = component.model, component.references
    if cycle % 10 == 0 and course != "rests":
        component.drive.receive(Twist(Vector(0.1, 0.03 if cycle < 60 else -0.1), Vector(0.0, 0.0, 0.2)))
        velocity = (0.0, -0.02, 0.0, 0.0, 0.02, 0.0) * 2
        component.targets.receive(WheelsSupport(velocity=velocity))
    if cycle == 40 and course == "lifted":
        named(component.services(), "lift").handler(LiftContacts(("rear_left_leg",), True))
    if course == "singular":
        references.velocity[2] = 0.3  # legs are stretched
    robot.update()
    component.update()
    component.send()
    moved = component.moved
    robot.state.velocity[moved] = robot.command.velocity[moved]


@pytest.mark.daily(4)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("course", "tags"),
    [
        ("drives", {}),
        ("drives", {"pace": True}),
        ("drives", {"base": "center_of_mass"}),
        ("drives", {"across": 0.0}),
        ("rests", {"across": 0.0}),
        ("rests", {}),
        ("lifted", {"base": "center_of_mass", "pace": True}),
        ("singular", {}),
        ("slow joints", {}),
        ("short ranges", {}),
    ],
)
def test_the_component_follows_the_law(make, course, tags):
    """Joint velocities of the compiled component are those of the plain law, at each state of a drive.

    The law has a memory of its own and is given the component's state, references and Jacobian. Courses reach what the
    law does at limits, at singular legs, with lifted wheels, and where vertices rest with an error.
    """
    speeds = {"slow joints": (0.4, 1.0)}.get(course)
    component = make(tags, speeds, 0.05 if course == "short ranges" else None)
    robot, law, moved = component.model, part("driving_cases.law"), component.moved
    if course == "rests":
        component.references.vertices[:, 1] += 3e-3
    plain, scales, counts = law.WheeledLaw(component), [], []
    for cycle in range(300 if course == "lifted" else 120):
        drive(component, cycle, course)
        velocity = plain.update(law.measured(component), component.references)
        assert_allclose(robot.command.velocity[moved], velocity[moved], atol=1e-8, rtol=0.0, err_msg=str(cycle))
        robot.state.position[moved] = robot.command.position[moved]
        scales.append(component.tasks.descent.scale)
        counts.append(component.tasks.descent.count)
    assert (min(scales) < 0.9) == (course == "slow joints")
    assert (max(counts) > 0) == (course == "short ranges")
    assert component.references.lifted.any() == (course == "lifted")


@pytest.mark.slow
def test_a_cycle_of_driving_keeps_no_memory(make):
    component = make({"pace": True})
    robot, references = component.model, component.references
    references.velocity[:2], references.vertex_velocity[:, 1] = (0.02, 0.01), (0.001, -0.001) * 2

    def cycle():
        robot.update()
        component.update()
        component.send()
        robot.state.position[:] = robot.command.position

    check_that_it_keeps_no_memory(cycle)


def test_the_pace_is_published(make):
    """The share of the velocities of others is published every 0.1 s, and where it changes by 0.02."""
    component = make({"pace": True})
    state = named(component.topics(), "wheels_state")
    pace = named(component.topics(), "pace")
    assert pace.collect().data == 1.0 and pace.collect() is None  # at the beginning, then where it changes
    messages = []
    for cycle in range(500):
        state.handler(WheelsState(y=1.0))
        drive(component, cycle, "rests")
        component.model.state.position[component.moved] = component.model.command.position[component.moved]
        messages.append(pace.collect())
    sent = [cycle for cycle, message in enumerate(messages) if message is not None]
    assert max(np.diff(sent)) <= 20  # 0.1 s
    assert min(messages[cycle].data for cycle in sent) < 0.1  # wheels turn
    assert messages[sent[-1]].data == pytest.approx(0.5 * component.references.pace, abs=0.02)  # half is `base_speed`
    assert component.references.pace > 0.5
