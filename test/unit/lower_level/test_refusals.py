"""What a lower level refuses of requests and commands, and what it says of itself."""

import numpy as np
import pytest
from support.unit.cart import DT, GAINS, GROUPS, RECORDS, URDF, bend, claim, make, turn
from support.unit.refusals import check_refusal

from solfer.errors import ClaimRefused, CommandRefused, SolferError, Suspended, UnknownName
from solfer.lower_level import LowerLevelRecord, LowerLevelServer, build_lower_level
from solfer.lower_level.records import RationRecord
from solfer.lower_level.server.server import largest_request
from solfer.model import Description, Kinematics
from solfer.transport.health import Health
from solfer.transport.inbox import Inbox


def asked(*arguments):
    """Make a claim."""
    return lambda cart: claim(cart, *arguments)


def twice(cart):
    """Command the wheel from two senders."""
    turn(cart, "/first")
    turn(cart, "/second")


CLAIM = "claim of '/a'"
COMMAND = "command of '/a'"
REFUSED = [
    (asked("", ("arm",)), CommandRefused, "without an owner or without controllers"),
    (asked("/a", ()), CommandRefused, "without an owner or without controllers"),
    (asked("/a", ("arms",)), UnknownName, "unknown controller 'arms' (did you mean arm?"),
    (asked("/a", ("arm",), ("positions",)), UnknownName, "'positions' (did you mean position"),
    (asked("/a", ("wheel",), ("effort",)), CommandRefused, "does not accept 'effort' (expected: one or more of"),
    (asked("/a", ("arm",), ("position", "effort")), CommandRefused, "2 modes for 1 controllers"),
    (asked("/a", ("arm",), (), ("sholder",)), UnknownName, "did you mean shoulder"),
    (asked("/a", ("arm",), (), ("roll",)), UnknownName, "unknown joint 'roll' (expected: joints of arm)"),
    (asked("/a", ("wheel", "arm"), (), ("elbow",)), UnknownName, "(expected: joints of wheel, arm)"),
    (twice, ClaimRefused, "'/second' cannot command roll of controller 'wheel': '/first' does (expected: joints"),
]


@pytest.mark.parametrize(("call", "error", "words"), REFUSED, ids=[words for *_, words in REFUSED])
def test_what_is_refused_changes_nothing(call, error, words):
    cart = make()
    check_refusal(lambda: call(cart), error, "", words)
    assert cart.claims.owners() in ((), ("/first",))


def test_a_stopped_controller_refuses_and_says_so():
    cart = make()
    cart.switch([], ["wheel"])
    for call, error, place, words in (
        (lambda: claim(cart, "/a", ("wheel",)), Suspended, CLAIM, "controller 'wheel' is stopped"),
        (lambda: turn(cart, "/a"), Suspended, COMMAND, "controller 'wheel' is stopped"),
        (lambda: cart.switch([], ["wheel"]), CommandRefused, "", "(expected: a controller that runs)"),
    ):
        check_refusal(call, error, place, words)


class LastReport:
    """A middleware that only keeps reports."""

    def __init__(self):
        self.last = ()

    def report(self, *report):
        self.last = report

    def __getattr__(self, name):
        return lambda *_: None


def test_health_tells_owners_refusals_and_holding():
    """Each state of health once: good, a warning that clears when nothing new is refused, and the stop's reason."""
    cart, node = make(), LastReport()
    server = LowerLevelServer(cart, node, Inbox())
    server._queues.clear()
    turn(cart, "/driver")
    server.report()
    assert node.last[:3] == ("lower_level", Health.GOOD, "running")
    assert node.last[3] == {
        "commands refused": 0,
        "commands dropped": 0,
        "commands of a cycle, at most": 0,
        "requests refused": 0,
        "requests of a cycle, at most": 0,
        "arm": "free",
        "wheel": "/driver: velocity",
    }
    for _ in range(2):
        with pytest.raises(SolferError):
            turn(cart, "/other")
    server.report()
    assert node.last[1:3] == (Health.WARNING, "2 commands refused") and node.last[3]["refused of /other"] == 2
    server.report()
    assert node.last[1:3] == (Health.GOOD, "running")  # nothing new
    cart.switch([], ["arm"])
    cart.emergency_stop("smoke")
    server.report()
    assert node.last[1] is Health.ERROR and "smoke" in node.last[2] and node.last[3]["arm"] == "stopped"


@pytest.mark.parametrize("tilt", [-40.0, 0.0, 40.0])
@pytest.mark.parametrize("about", [3, 4])
@pytest.mark.parametrize("turned", ["1.0 0.0 0.0", "0.0 1.0 0.0", "0.3 0.4 1.2"])
def test_the_tilt_is_that_of_the_world(tilt, about, turned):
    # the floating joint has an origin of its own, so that the chart's axes are not those of the world
    joint = '<parent link="world"/><child link="base"/>'
    urdf = URDF.replace(joint, f'<origin rpy="{turned}" xyz="0 0 0"/>{joint}')
    kinematics = Kinematics(Description.from_text(urdf))
    cart = build_lower_level(kinematics, RECORDS, GROUPS, GAINS, LowerLevelRecord(tilt=np.radians(30.0), tilt_time=0.0))
    q = np.zeros(8)
    q[about], q[5] = np.radians(tilt), 0.7
    cart.start(q)
    kinematics.update(q, np.zeros(8))
    tilt = np.degrees(np.arccos(np.clip(kinematics.rotation("base")[2, 2], -1.0, 1.0)))
    assert (f"tilted by {tilt:.0f} degrees, beyond 30 degrees" in cart.safeguard.reason) is bool(tilt > 30.0)


def test_effort_at_a_bound_is_accepted():
    cart = make()
    bend(cart, "/a", effort=40.0)
    cart.update(np.zeros(8), np.zeros(8), DT)
    assert cart.controllers["arm"].effort[0] == 40.0


def test_what_is_suspended_says_of_whom():
    cart = make()
    cart.emergency_stop("smoke")
    check_refusal(lambda: turn(cart, "/a"), Suspended, COMMAND, "smoke")
    check_refusal(lambda: claim(cart, "/a", ("arm",)), Suspended, CLAIM, "smoke")


@pytest.mark.parametrize("largest", [None, 5000])
def test_services_take_requests_that_name_all_joints(largest):
    class Offers(LastReport):
        def serve(self, owner, services, submit):
            sizes.update(service.largest for service in services)

    sizes = set()
    cart = make(ration=RationRecord(request=largest))
    LowerLevelServer(cart, Offers(), Inbox())
    assert sizes == {largest or largest_request(cart)} and largest_request(cart) > 0
