"""What a lower level says of requests and commands that it refuses, word for word, and of itself."""

import numpy as np
import pytest
from support.unit.cart import DT, GAINS, GROUPS, RECORDS, URDF, bend, claim, make, turn

from solfer.errors import SolferError
from solfer.lower_level import LowerLevelRecord, LowerLevelServer, build_lower_level
from solfer.lower_level.records import RationRecord
from solfer.lower_level.server.server import largest_request
from solfer.lower_level.server.services import lower_level_services
from solfer.model import Description, Kinematics
from solfer.transport.health import Health
from solfer.transport.inbox import Inbox
from solfer.transport.messages import JointMessage

ACCEPTED = "position, velocity, effort, stiffness, damping"


def arm(names=("shoulder",), **fields):
    """Make the sending of a command for the arm."""
    return lambda cart: cart.accept("arm", JointMessage(names, sender="/a", **fields))


def twice(cart):
    """Command the wheel from two senders."""
    turn(cart, "/first")
    turn(cart, "/second")


def asked(*arguments):
    """Make a claim by a plugin."""
    return lambda cart: claim(cart, "/a", *arguments)


ONE, TWO = np.zeros(1), np.zeros(2)
REFUSED = {
    asked(()): "a claim without an owner or without controllers|the name of the plugin and at least one controller|",
    lambda cart: claim(cart, "", ("arm",)): "a claim without an owner or without controllers"
    "|the name of the plugin and at least one controller|",
    asked(("arms",)): "unknown controller 'arms'||arm",
    asked(("arm",), ("position", "effort")): "2 modes for 1 controllers|one for each, or none|",
    asked(("arm",), ("positions",)): "unknown mode 'positions'||position, stiffness",
    asked(("wheel",), ("position",)): "controller 'wheel' does not accept 'position'|one or more of velocity|",
    asked(("arm",), (), ("roll",)): "unknown joint 'roll'|joints of arm|",
    asked(("wheel", "arm"), (), ("elbow",)): "unknown joint 'elbow'|joints of wheel, arm|",
    twice: "'/second' cannot command roll of controller 'wheel': '/first' does"
    "|joints that are free: '/first' has to end or to send nothing for 0.3 s|",
    arm(): f"the command carries no numbers|one or more of {ACCEPTED}|",
    arm((), position=np.zeros(0)): f"the command carries no numbers|one or more of {ACCEPTED}|",
    arm(interfaces=("force",)): f"the controller does not accept 'force'|one or more of {ACCEPTED}|",
    arm(("sholder",), position=ONE): "unknown joint 'sholder'|joints of this controller: shoulder|shoulder",
    arm(("shoulder",) * 2, position=TWO): "joint 'shoulder' is named 2 times|every joint once at most|",
    arm(position=TWO): "'position' has the shape (2,) for 1 joints|1 numbers, one for each joint|",
    arm(position=["a"]): "'position' is not an array of numbers|one number for each joint|",
    arm(position=[3.0]): "position 3 of joint 'shoulder' is beyond its limit|from -2 to 2 [rad]|",
    arm(effort=[np.nan]): "effort nan of joint 'shoulder' is not a finite number|from -40 to 40 [Nm]|",
    arm(velocity=[4.0]): "velocity 4 of joint 'shoulder' is beyond its limit|from -3 to 3 [rad/s]|",
    arm(stiffness=[-1.0]): "stiffness -1 of joint 'shoulder' is beyond its limit|from 0 to 100000 [Nm/rad]|",
    arm(damping=[-1.0]): "damping -1 of joint 'shoulder' is beyond its limit|from 0 to 100000 [Nms/rad]|",
    lambda cart: cart.switch(["arm"], ["arm"]): "controller 'arm' is to be started and stopped"
    "|each controller in one of the two lists|",
    lambda cart: cart.switch(["arm"], []): "controller 'arm' runs already|a controller that is stopped|",
}


@pytest.mark.parametrize(("refused", "text"), REFUSED.items(), ids=REFUSED.values())
def test_refusals_say_what_is_expected(refused, text):
    with pytest.raises(SolferError) as error:
        refused(make())
    assert f"{error.value.what}|{error.value.expected}|{', '.join(error.value.names)}" == text


def test_a_stopped_controller_refuses_and_says_so():
    cart = make()
    cart.switch([], ["wheel"])
    listed = lower_level_services(cart)[2].handler(None)
    assert listed.states == ("running", "stopped") and listed.types == ("impedance", "velocity")
    assert listed.joints == ("shoulder", "roll") and listed.claimed_by == ("", "")
    for attempt, what in ((lambda: claim(cart, "/a", ("wheel",)), "claim"), (lambda: turn(cart, "/a"), "command")):
        with pytest.raises(SolferError) as error:
            attempt()
        assert (error.value.what, error.value.where) == ("controller 'wheel' is stopped", f"{what} of '/a'")
    with pytest.raises(SolferError) as error:
        cart.switch([], ["wheel"])
    assert error.value.expected == "a controller that runs"


class Reports:
    """A middleware that only keeps reports."""

    def __init__(self):
        self.last = ()

    def report(self, *report):
        self.last = report

    def __getattr__(self, name):
        return lambda *_: None


def test_health_tells_owners_refusals_and_holding():
    """Each state of health once: good, a warning that clears when nothing new is refused, and the stop's reason."""
    cart, node = make(), Reports()
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
    for attempt, where in (
        (lambda: turn(cart, "/a"), "command of '/a'"),
        (lambda: claim(cart, "/b", ("arm",)), "claim of '/b'"),
    ):
        with pytest.raises(SolferError) as error:
            attempt()
        assert error.value.where == where and "smoke" in error.value.what


@pytest.mark.parametrize("largest", [None, 5000])
def test_services_take_requests_that_name_all_joints(largest):
    class Offers(Reports):
        def serve(self, owner, services, submit):
            sizes.update(service.largest for service in services)

    sizes = set()
    cart = make(ration=RationRecord(request=largest))
    LowerLevelServer(cart, Offers(), Inbox())
    assert sizes == {largest or largest_request(cart)} and largest_request(cart) > 0
