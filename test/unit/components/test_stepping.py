"""The component `wheeled_motion` whose wheels step."""

import math
import re

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from support.unit.declarations import named
from support.unit.wheeled import LOWER, RATE, cycle, recorded, robot  # noqa: F401, fixtures
from support.unit.wheeled import make as make_any  # noqa: F401

from solfer.components.wheeled_motion.support import LoadBalance
from solfer.errors import ComponentError, NotFinite, UnknownName
from solfer.interfaces.support import LiftContacts, StepContact

LEGS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")


@pytest.fixture
def make(make_any):
    """Make the component with the centre of mass as its base."""
    return lambda **tags: make_any(**{"base": "center_of_mass"} | tags)


def places(component):
    """Return the vertices in the world, shape (4, 3) [m]."""
    return np.array([vertex.value for vertex in component.wheels.offsets.vertices])


class Floor:
    """A floor that pushes each wheel by half a newton for each micrometre below its own height.

    Args:
        component: The component.
        heights: Height below each wheel, shape (4,) [m].
    """

    def __init__(self, component, heights):
        self._component = component
        self.heights = heights

    def run(self, cycles=1):
        """Let cycles pass."""
        for _ in range(cycles):
            cycle(self._component)
            lifted = self._component.references.lifted
            for index, leg in enumerate(LEGS):
                depth = self.heights[index] - places(self._component)[index, 2]
                force = max(0.0, 5e4 * depth) if lifted[index] else 250.0
                self._component.model.contacts[leg].wrench[2] = force

    def finish(self, answer):
        """Run until a request is answered; return the answer."""
        for _ in range(6000):
            if answer.done():
                return answer.result()
            self.run()
        raise AssertionError(f"no answer: {self._component._lifting.phase}")


@pytest.fixture
def stepping(make):
    """Make the component on a floor, and what steps its wheels."""
    component = make()
    cycle(component, 10)
    floor = Floor(component, places(component)[:, 2].copy())
    step = named(component.services(), "step")
    assert step.interface == "solfer/StepContact"
    return component, floor, step.handler


@pytest.mark.parametrize(("wheel", "place"), [(0, (-0.1, 0.02, 0.05)), (3, (0.12, 0.0, 0.0)), (2, (0.1, 0.0, 0.08))])
def test_a_wheel_stands_where_it_has_stepped(stepping, wheel, place):
    """It goes up, across and down, and never below its clearance on the way; the others stay."""
    component, floor, step = stepping
    before, others = places(component), [each for each in range(4) if each != wheel]
    ground = floor.heights[wheel]
    answer = step(StepContact(LEGS[wheel], *place, 0.02))
    highest, across = 0.0, []
    while not answer.done():
        floor.run()
        way = places(component)[wheel] - before[wheel]
        highest = max(highest, way[2])
        floor.heights[wheel] = ground + place[2] * (math.hypot(*way[:2]) > 0.05)
        if 0.01 < math.hypot(*way[:2]) < math.hypot(*place[:2]) - 0.01:
            across.append(way[2])
    assert answer.result().success and answer.result().message == ""
    assert_allclose(places(component)[wheel] - before[wheel], place, atol=0.012)
    assert highest < max(0.0, place[2]) + 0.03 and min(across) > max(0.0, place[2]) + 0.008
    assert_allclose(places(component)[others, :2], before[others, :2], atol=8e-3)
    assert not component.references.lifted.any()
    rest = places(component)
    floor.run(200)
    assert_allclose(places(component), rest, atol=2e-3)


def test_the_request_of_the_page_is_a_step(stepping, repository):
    """With the names and numbers of the command, which the soak calls."""
    page = (repository / "docs/reference/wheeled_motion.md").read_text()
    (text,) = re.findall(r'^rosservice call /stepping/step "(.*)"$', page, re.MULTILINE)
    request = StepContact(**yaml.safe_load(text))
    component, floor, step = stepping
    before, wheel = places(component), LEGS.index(request.contact)
    assert floor.finish(step(request)).success
    assert_allclose((places(component) - before)[wheel], (request.ahead, request.left, request.up), atol=0.012)


@pytest.mark.parametrize(
    ("height", "from_", "stands", "text"),
    [
        (0.04, 0.09, True, "stands 0.03. m higher"),
        (-0.025, 0.09, True, "stands 0.02. m lower"),
        (-0.1, 0.05, False, "no ground below 'rear_left_leg'"),
        (0.06, 0.05, False, "in its way"),
    ],
)
def test_a_wheel_stands_on_other_ground_or_goes_back(stepping, height, from_, stands, text):
    """The ground is higher or lower than expected from some way across on; what it does, the answer says."""
    component, floor, step = stepping
    before = places(component)
    ground = floor.heights[2]
    answer = step(StepContact(LEGS[2], 0.1, 0.0, 0.0, 0.05 if stands else 0.03))
    while not answer.done():
        across = math.hypot(*(places(component)[2] - before[2])[:2])
        floor.heights[2] = ground + height * (across > from_)
        floor.run()
    assert answer.result().success is stands and re.search(text, answer.result().message)
    goal = before[2] + ((0.1, 0.0, height) if stands else (0.0, 0.0, 0.0))
    assert_allclose(places(component)[2], goal, atol=0.012)
    assert not component.references.lifted.any()


@pytest.mark.parametrize("cycles", [20, 700])
def test_a_new_start_answers_and_a_lifted_wheel_stays_lifted(stepping, cycles):
    component, floor, step = stepping
    answer = step(StepContact(LEGS[3], 0.12, 0.0, 0.0, 0.03))
    floor.run(cycles)
    was_lifted = component.references.lifted.copy()
    component.init()
    assert not answer.result(0).success and "stopped" in answer.result().message
    assert (component.references.lifted == was_lifted).all()
    assert floor.finish(named(component.services(), "lift").handler(LiftContacts(lifted=False))).success
    assert not component.references.lifted.any()


@pytest.mark.parametrize("cycles", [20, 300, 700, 900, 1100, 1300])
def test_a_step_given_up_ends_on_all_wheels(stepping, cycles):
    component, floor, step = stepping
    before = places(component)
    answer = step(StepContact(LEGS[3], 0.12, 0.0, 0.0, 0.03))
    floor.run(cycles)
    back = named(component.services(), "lift").handler(LiftContacts((LEGS[3],), lifted=False))
    assert floor.finish(back).success and floor.finish(answer).success == (answer.result().message == "")
    assert not component.references.lifted.any()
    assert abs(places(component)[:, 2] - before[:, 2]).max() < 0.012


@pytest.mark.parametrize(
    ("request_", "error", "text"),
    [
        (StepContact("front_left_log", 0.1), UnknownName, "front_left_leg"),
        (StepContact(LEGS[0], math.nan), NotFinite, "not finite"),
        (StepContact(LEGS[0], 0.1, clearance=math.inf), NotFinite, "not finite"),
        (StepContact(LEGS[0], 1.2), ComponentError, "a step by 1.2 0 0 m"),
        (StepContact(LEGS[0], 0.1, clearance=-0.1), ComponentError, "clearance of -0.1"),
        (StepContact(LEGS[0], 0.5), ComponentError, "'front_left_leg' does not reach"),
        (StepContact(LEGS[2], 0.0, up=0.6), ComponentError, "at the bound"),
    ],
)
def test_a_step_that_cannot_be_is_refused(stepping, request_, error, text):
    component, floor, step = stepping
    before = places(component)
    with pytest.raises(error, match=text):
        step(request_)
    floor.run(50)
    assert_allclose(places(component), before, atol=1e-6)


def test_two_steps_at_once_are_refused(stepping):
    component, floor, step = stepping
    answer = step(StepContact(LEGS[3], 0.1))
    floor.run(10)
    with pytest.raises(ComponentError, match="the weight is shifted"):
        step(StepContact(LEGS[2], 0.1))
    assert floor.finish(answer).success
    component.references.lifted[0] = True
    with pytest.raises(ComponentError, match="2 wheels would carry"):
        step(StepContact(LEGS[2], 0.1))
    with pytest.raises(ComponentError, match="is lifted"):
        step(StepContact(LEGS[0], 0.1))


def test_wheels_that_carry_too_much_go_up(make):
    """What least squares do not explain of the forces is a twist: two opposite wheels up, two down."""
    component = make()
    cycle(component, 5)
    lifted, rates = np.zeros(4, dtype=bool), np.zeros(12)
    balance = LoadBalance(component.wheels, lifted, rates)
    for leg, force in zip(LEGS, (300.0, 200.0, 200.0, 300.0), strict=True):
        component.model.contacts[leg].wrench[2] = force
    balance.update()
    assert_allclose(rates[2::3], np.array((0.2, -0.2, -0.2, 0.2)) * 0.01, atol=1e-4)
    assert not rates.reshape(4, 3)[:, :2].any()
    for leg, force in zip(LEGS, (300.0, 300.0, 200.0, 200.0), strict=True):  # it leans ahead
        component.model.contacts[leg].wrench[2] = force
    balance.update()
    assert_allclose(rates, 0.0, atol=1e-5)
    lifted[1] = True
    balance.update()
    assert not rates.any()
