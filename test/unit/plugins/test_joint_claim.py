"""How a plugin asks for its joints and gives them back, against a lower level that answers when the test lets it."""

import numpy as np
import pytest
from support.unit.joint_pipes import RATE, dofs, make_robot, published

from solfer.errors import ClaimRefused
from solfer.interfaces.declaration import Service
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import JointCommandPipe, PipeContext, factory
from solfer.pipes.joint.calibration import Calibration
from solfer.pipes.joint.pipes import JointReceiver
from solfer.plugins.joint_claim import CLAIM_REPEAT_PERIOD, CLAIM_SETTLING_TIME, REFUSAL_GRACE, JointClaim
from solfer.transport import Inbox
from solfer.transport.lower_level import (
    ALL_OWNERS,
    CLAIM_INTERFACE,
    LOWER_LEVEL,
    REFUSALS_TOPIC,
    RELEASE,
    TOPIC,
    Answer,
    ClaimAnswer,
    ClaimRequest,
    ReleaseRequest,
)
from solfer.transport.messages import REFUSALS, RefusalMessage


class LowerLevel:
    """Gives each claim the same answer, and writes down what it was asked for; `inbox.apply` lets it answer."""

    def __init__(self, bus, answer):
        self.answer, self.asked, self.requests, self.inbox = answer, [], [], Inbox()
        services = [
            Service("claim", CLAIM_INTERFACE, ClaimRequest, ClaimAnswer, self._claim),
            Service("release", RELEASE, ReleaseRequest, Answer, self._release),
        ]
        MemoryMiddleware(bus, "simulator").serve(LOWER_LEVEL, services, self.inbox.submit)

    def _claim(self, request):
        self.asked.append(("claim", request.owner, request.joints))
        self.requests.append(request)
        return self.answer

    def _release(self, request):
        self.asked.append(("release", request.owner))
        return Answer()


def meet(answer, node="cart"):
    """Make the claim of a cart on its arm and its wheel, the lower level that it asks, and a clock."""
    bus = Bus()
    middleware = MemoryMiddleware(bus, node)
    record = published(name="arm", type="impedance", sink="/command", dofs=dofs(mapping="ACTUATED"))
    pipe = factory.controller(record, PipeContext(make_robot(), middleware, {}, RATE))
    return JointClaim("cart", [pipe], middleware), LowerLevel(bus, answer), bus


REQUEST = ("claim", "cart", ("roll", "shoulder"))


def test_it_asks_again_after_a_pause():
    """A refusal that may pass is repeated after AGAIN seconds: not sooner, which would flood the lower level."""
    claim, lower_level, bus = meet(ClaimAnswer(False, "the robot has fallen", later=True))
    assert not claim.granted()
    lower_level.inbox.apply()
    for _ in range(3):
        assert not claim.granted() and claim.reason == "the robot has fallen"
        lower_level.inbox.apply()
    bus.run_until(CLAIM_REPEAT_PERIOD - 0.01)
    claim.granted()
    lower_level.inbox.apply()
    assert lower_level.asked == [REQUEST]
    bus.run_until(CLAIM_REPEAT_PERIOD)
    lower_level.answer = ClaimAnswer()
    assert not claim.granted()
    lower_level.inbox.apply()
    assert claim.granted() and claim.reason == ""
    assert lower_level.asked == [REQUEST] * 2


def test_it_asks_for_nothing_before_its_release_is_answered():
    claim, lower_level, _ = meet(ClaimAnswer())
    claim.granted()
    lower_level.inbox.apply()
    assert claim.granted()
    claim.release()
    assert not claim.released and not claim.granted()
    lower_level.inbox.apply()
    assert lower_level.asked == [REQUEST, ("release", "cart")]
    assert claim.released and not claim.granted()
    lower_level.inbox.apply()
    assert claim.granted() and lower_level.asked[2:] == [REQUEST]


def test_a_claim_has_what_is_measured_in_the_numbers_of_the_hardware():
    bus, robot = Bus(), make_robot()
    middleware, mapping = MemoryMiddleware(bus, "cart"), robot.maps["ACTUATED"]
    calibration = Calibration([f"J_{name}" for name in mapping.external], [1, -1], [0.0, 0.3])
    writer = middleware.writer("arm/command", "solfer/JointCommand")
    pipe = JointCommandPipe("arm", writer, mapping, robot.command, ("position",), receiver=JointReceiver(calibration))
    lower_level = LowerLevel(bus, ClaimAnswer())
    place = np.where(np.array(robot.dofs) == "shoulder", 0.2, np.nan)
    claim = JointClaim("cart", [pipe], middleware, position=lambda: place)
    claim.granted()
    lower_level.inbox.apply()
    (request,) = lower_level.requests
    assert request.joints == ("J_roll", "J_shoulder")
    assert np.isnan(request.positions[0]) and request.positions[1] == pytest.approx(0.1)


def test_a_robot_in_another_state_is_known_while_waiting():
    """Also before a claim, and to a plugin that commands nothing; refusals of others do not matter."""
    claim, _, bus = meet(ClaimAnswer())
    refusals = MemoryMiddleware(bus, "simulator").writer(REFUSALS_TOPIC, REFUSALS)
    refusals.write(RefusalMessage(("cart", "other"), (True, True), ("early", "else")))
    assert not claim.restarts()
    refusals.write(RefusalMessage(("other", ALL_OWNERS), (True, True), ("else", "another state")))
    assert claim.restarts() and claim.reason == "another state"
    claim.lapse()
    assert not claim.restarts()


def test_a_component_claims_and_releases_in_its_name():
    claim, lower_level, bus = meet(ClaimAnswer(), node="/limbs")
    claim.granted()
    lower_level.inbox.apply()
    assert claim.granted()
    bus.run_until(2.0 * REFUSAL_GRACE)
    refusals = MemoryMiddleware(bus, "simulator").writer(REFUSALS_TOPIC, REFUSALS)
    for owner, lost in (("/limbs", False), ("/limbs#other", False), ("/limbs#cart", True)):
        refusals.write(RefusalMessage((owner,), (True,), ("not yours",)))
        assert claim.lost() is lost
    claim.release()
    lower_level.inbox.apply()
    assert [asked[:2] for asked in lower_level.asked] == [("claim", "/limbs#cart"), ("release", "/limbs#cart")]


def test_a_claim_that_is_refused_for_good_ends_the_plugin():
    claim, lower_level, _ = meet(ClaimAnswer(False, "'other' has 'roll'"))
    claim.granted()
    lower_level.inbox.apply()
    with pytest.raises(ClaimRefused, match="plugin 'cart' does not get its joints: 'other' has 'roll'"):
        claim.granted()


def test_what_happens_to_joints_is_noted():
    claim, lower_level, bus = meet(ClaimAnswer())
    notes = []
    claim.note = lambda *note: notes.append(note)
    claim.granted()
    lower_level.inbox.apply()
    assert claim.granted()
    bus.run_until(bus.time + 2.0 * REFUSAL_GRACE)
    MemoryMiddleware(bus, "simulator").writer(REFUSALS_TOPIC, REFUSALS).write(
        RefusalMessage(("cart",), (True,), ("fallen",))
    )
    assert claim.lost() and claim.lost()
    claim.release()
    joints = "arm: 2 joints"
    assert notes == [("claim", joints), ("lost", "fallen"), ("release", joints)]


def granted(**claimed):
    """Make a claim that is granted, the clock, and what the lower level publishes refusals with."""
    claim, lower_level, bus = meet(ClaimAnswer(**claimed.pop("answer", {})), **claimed)
    claim.granted()
    lower_level.inbox.apply()
    claim.granted()
    return claim, lower_level, bus, MemoryMiddleware(bus, "simulator").writer(REFUSALS_TOPIC, REFUSALS)


def test_refusals_of_earlier_commands_are_ignored():
    claim, _, bus, refusals = granted()
    bus.run_until(0.9 * REFUSAL_GRACE)
    refusals.write(RefusalMessage(("cart",), (True,), ("early",)))
    assert not claim.lost() and claim.refused == 0
    bus.run_until(REFUSAL_GRACE)
    refusals.write(RefusalMessage(("cart", "other"), (True, True), ("fallen", "else")))
    assert claim.lost() and (claim.reason, claim.refused, claim.restarted) == ("fallen", 1, False)
    refusals.write(RefusalMessage((ALL_OWNERS, "cart"), (True, True), ("another state", "void")))
    assert claim.lost() and (claim.reason, claim.refused, claim.restarted) == ("another state", 2, True)
    claim.lapse()
    assert not claim.restarted


def test_a_wrong_command_is_a_warning(caplog):
    claim, _, bus, refusals = granted()
    bus.run_until(2.0 * REFUSAL_GRACE)
    refusals.write(RefusalMessage(("cart",), (False,), ("beyond its limit",)))
    assert not claim.lost() and claim.refused == 1
    warning = "the lower level refuses a command: beyond its limit"
    assert claim.warning() == warning and claim.warning() == ""
    assert caplog.messages == [f"cart: {warning}"]


def test_without_claims_commands_go_out(caplog):
    bus = Bus()
    middleware = MemoryMiddleware(bus, "cart")
    record = published(name="arm", type="impedance", sink="/command", dofs=dofs(mapping="ACTUATED"))
    claim = JointClaim(
        "cart", [factory.controller(record, PipeContext(make_robot(), middleware, {}, RATE))], middleware
    )
    claim.granted()
    bus.run_until(10.0)
    assert claim.granted()
    assert caplog.messages == ["cart commands without a claim: this lower level does not support claims"]


def test_a_follower_waits_for_its_publishers():
    """Its inputs need time to settle after a claim, and a restart of what follows it costs it the claim."""
    bus = Bus()
    middleware, arm = MemoryMiddleware(bus, "cart"), published(name="arm", type="impedance", sink="/command")
    pipe = factory.controller(arm, PipeContext(make_robot(), middleware, {}, RATE))
    lower_level = LowerLevel(bus, ClaimAnswer(again=True))
    claim = JointClaim("cart", [pipe], middleware, follows=["/goal"], publishes=["/pose"])
    claim.granted()
    lower_level.inbox.apply()
    assert not claim.granted()
    bus.run_until(0.9 * CLAIM_SETTLING_TIME)
    assert not claim.granted()
    bus.run_until(CLAIM_SETTLING_TIME)
    assert claim.granted()
    refusals = MemoryMiddleware(bus, "simulator").writer(REFUSALS_TOPIC, REFUSALS)
    refusals.write(RefusalMessage(("topic goal", f"{TOPIC}goal"), (True, True), ("not ours", "not ours")))
    assert not claim.lost()
    refusals.write(RefusalMessage((f"{TOPIC}pose",), (True,), ("a follower begins anew",)))
    assert claim.lost() and claim.reason == "a follower begins anew" and claim.refused == 0


def test_who_commands_nothing_asks_for_nothing():
    bus = Bus()
    lower_level = LowerLevel(bus, ClaimAnswer())
    claim = JointClaim("cart", [], MemoryMiddleware(bus, "cart"))
    assert claim.granted()
    claim.damp()
    claim.release()
    claim.lapse()
    lower_level.inbox.apply()
    assert claim.granted() and claim.released and lower_level.asked == []
