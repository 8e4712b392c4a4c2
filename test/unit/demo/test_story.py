"""Requests of the demonstration on a machine that stands still for a moment."""

import pytest

from solfer.components.joint_states import MoveJoints
from solfer.errors import ComponentError
from solfer_tools.demo.story import UPPER, StoryStep, StoryTeller


class Refusing:
    """A middleware whose plugin refuses until a time [s]."""

    def __init__(self, until):
        self.until, self.time, self.asked = until, 0.0, []

    def now(self):
        return self.time

    def running(self):
        return True

    def sleep_until(self, time):
        self.time = time

    def call(self, service, interface, request, reply, timeout):
        self.asked.append(service)
        return reply(success=self.time >= self.until, message="its own loop stood still")

    def collect(self):
        """Collect what a recorder would."""


@pytest.mark.parametrize("until", [0.0, 0.25])
def test_a_refusal_of_a_moment_is_no_end(until):
    middleware = Refusing(until)
    teller = StoryTeller(middleware, middleware, lambda *_: None)
    teller.publish(StoryStep("arms", {UPPER: MoveJoints(state="reset")}), settle=0.0)
    assert middleware.asked == [f"{UPPER}/trajectory"] * (1 + 3 * bool(until))


def test_a_refusal_that_stays_is_reported():
    middleware = Refusing(1e9)
    teller = StoryTeller(middleware, middleware, lambda *_: None)
    with pytest.raises(ComponentError, match=f"'arms' is refused by {UPPER}: its own loop stood still"):
        teller.publish(StoryStep("arms", {UPPER: MoveJoints(state="reset")}))
    assert 2.9 < middleware.time < 3.2
