"""The component `wheeled_motion` with wheels that are lifted."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import lower_body
from support.unit.declarations import named
from support.unit.wheeled import LOWER, RATE, cycle, recorded, robot  # noqa: F401, fixtures
from support.unit.wheeled import make as make_any  # noqa: F401

from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.support import LiftContacts
from solfer.points import SupportVertex
from solfer.tasks.task import updated_in_order

WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
LEGS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")


@pytest.fixture
def make(make_any):
    """Make the component with the centre of mass as its base."""
    return lambda **tags: make_any(**{"base": "center_of_mass"} | tags)


def update(robot, point):
    robot.update()
    for part in updated_in_order(point):
        part.update()


def ask(component, *contacts, lifted=True):
    """Call the service; return its answer, which may take a while."""
    service = named(component.services(), "lift")
    assert service.interface == "solfer/LiftContacts"
    return service.handler(LiftContacts(contacts, lifted))


def lift(component, *contacts, lifted=True):
    """Call the service, and wait for its answer."""
    answer = ask(component, *contacts, lifted=lifted)
    for _ in range(2000):
        if answer.done():
            return answer.result()
        cycle(component)
    raise AssertionError(f"no answer: {component._lifting.phase}")


def margin(component, *wheels):
    """Return how far the centre of mass is inside the triangle of the other wheels [m]."""
    component.model.update()
    corners = []
    for index, wheel in enumerate(WHEELS):
        if index not in wheels:
            vertex = SupportVertex(wheel, component.model, 0.01, 0.068, (0.0, 0.0, (-1.0) ** index))
            update(component.model, vertex)
            corners.append(vertex.value[:2].copy())
    a, b, c = corners
    center = component.model.center_of_mass.value[:2]
    sides = [np.linalg.det([q - p, center - p]) / np.linalg.norm(q - p) for p, q in ((a, b), (b, c), (c, a))]
    return min(np.sign(np.linalg.det([b - a, c - a])) * np.array(sides))


@pytest.mark.parametrize(("wheel", "velocity"), [(3, (0.0, 0.0, 0.0)), (0, (0.05, 0.0, 0.1))])
def test_the_vertex_of_a_lifted_wheel_follows_its_reference(make, wheel, velocity):
    """It rises within a millimetre of its reference, at rest and in a turn, while no other wheel slips."""
    component = make()
    cycle(component, 100, velocity)
    robot, references, others = component.model, component.references, [each for each in range(4) if each != wheel]
    assert lift(component, LEGS[wheel]).success
    vertex = SupportVertex(WHEELS[wheel], robot, 0.01, 0.068, (0.0, 0.0, (-1.0) ** wheel))
    update(robot, vertex)
    before, start = vertex.value[2], references.vertices[wheel, 2]
    assert_allclose(start, before, atol=1e-3)
    references.vertex_velocity[wheel] = 0.01, -0.01, 0.04
    rows = np.concatenate([np.arange(3 * each, 3 * each + 3) for each in others])
    for _ in range(20):
        cycle(component, 10, velocity)
        assert abs(component.stack.jacobian[rows] @ robot.command.velocity).max() < 1e-5  # no other wheel slips
    update(robot, vertex)
    assert_allclose(vertex.value[2] - before, references.vertices[wheel, 2] - start, atol=1e-3)
    assert 0.03 < vertex.value[2] - before < 0.041
    errors = component.wheels.offsets.errors
    assert abs(errors[wheel]).max() < 1e-3 and abs(errors[others][:, :2]).max() < 3e-3
    assert references.pace > 0.99


def places(component):
    """Return the vertices in the world, shape (4, 3) [m]."""
    return np.array([vertex.value for vertex in component.wheels.offsets.vertices])


@pytest.mark.parametrize("wheel", [0, 3])
def test_the_weight_is_shifted_before_a_lift(make, wheel):
    """The support margin without that wheel grows before it leaves the ground, and all returns when it is put down."""
    component = make()
    cycle(component, 10)
    before, standing = component.references.vertices.copy(), places(component)
    start = component.references.position.copy()
    assert margin(component, wheel) < 0.059
    assert lift(component, LEGS[wheel]).success
    assert margin(component, wheel) > 0.049
    assert_allclose(places(component), standing, atol=8e-3)  # tilted wheels move a little
    component.references.vertex_velocity[wheel, 2] = 0.05
    cycle(component, 100)
    component.references.vertex_velocity[wheel] = 0.0
    assert places(component)[wheel, 2] > standing[wheel, 2] + 0.02
    assert margin(component, wheel) > 0.035
    assert lift(component, LEGS[wheel], lifted=False).success and not component.references.lifted.any()
    assert_allclose(places(component), standing, atol=8e-3)
    assert_allclose(component.references.position[:2], start[:2], atol=1e-3)
    assert_allclose(component.references.vertices[:, :2], before[:, :2], atol=8e-3)


@pytest.mark.parametrize("cycles", [20, 300, 700, 1000])
def test_a_lift_given_up_ends_on_all_wheels(make, cycles):
    component = make()
    cycle(component, 10)
    standing, start = places(component), component.references.position.copy()
    answer = ask(component, LEGS[0])
    cycle(component, cycles)
    was_lifted = component.references.lifted.any()
    assert lift(component, lifted=False).success
    assert answer.result().success == was_lifted
    assert not component.references.lifted.any()
    assert_allclose(places(component), standing, atol=8e-3)
    assert_allclose(component.references.position[:2], start[:2], atol=1e-3)


def test_a_wheel_finds_ground_that_pushes(make):
    """The ground is 10 mm lower than before: the wheel must go on until a force answers, and no deeper than 13 mm."""
    component = make()
    robot, depth = component.model, 0.0
    cycle(component, 10)
    ground = places(component)[:, 2]
    assert lift(component, LEGS[3]).success
    for leg in LEGS[:3]:
        robot.contacts[leg].wrench[2] = 300.0
    answer = ask(component, LEGS[3], lifted=False)
    while not answer.done():
        cycle(component)
        depth = max(depth, ground[3] - places(component)[3, 2])
        for index, leg in enumerate(LEGS):
            is_low = places(component)[index, 2] < ground[index] - 0.01 * (index == 3)
            robot.contacts[leg].wrench[2] = 300.0 if index != 3 or is_low else 0.0
    assert answer.result().success and 0.01 < depth < 0.013  # the ground is 10 mm lower there


def test_a_wheel_that_is_set_down_steers_again(make):
    component = make()
    lift(component, LEGS[1])
    cycle(component, 20)
    assert not component.stack.jacobian[3:6].any()
    lift(component, LEGS[1], lifted=False)
    cycle(component, 400, (0.0, 0.1, 0.0))
    assert (
        component.stack.jacobian[3:6].any()
        and abs(component.stack.jacobian[:12] @ component.joints.velocity).max() < 1e-5
    )
    assert abs(component.wheels.offsets.errors[:, :2]).max() < 5e-3 and component.references.position[1] > 0.1


def test_too_few_wheels_are_never_left(make):
    component = make()
    with pytest.raises(UnknownName, match="tracked contact 'left_arm'"):
        ask(component, "left_arm")
    lift(component, LEGS[2])
    for contacts in ((LEGS[0],), ()):
        with pytest.raises(ComponentError, match="would carry the robot"):
            ask(component, *contacts)
    assert component.references.lifted.tolist() == [False, False, True, False]
    lift(component, lifted=False)
    assert not component.references.lifted.any()


@pytest.mark.parametrize("base", ["link", "center_of_mass"])
def test_a_part_of_the_robot_lifts_no_wheel(repository, base):
    """It has not all masses, whatever it tracks: where the whole robot's weight is, it does not know."""
    record = load(repository / "config/centauro.yaml", "locomotion").tags(WheeledMotion.Tags)
    component = WheeledMotion(lower_body(), record.model_copy(update={"base": base}).placed_as(record), "legs")
    component.set_rate(RATE)
    with pytest.raises(ComponentError, match="do not show where its weight is"):
        ask(component, LEGS[0])
    assert not component.references.lifted.any() and not component.references.waits


def test_the_whole_robot_lifts_wheels_by_its_link_too(make):
    component = make(base="link")
    assert lift(component, LEGS[2]).success and margin(component, 2) > 0.02
