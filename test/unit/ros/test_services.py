"""Declared services as services of ROS, without a master: the test calls what rospy would call."""

from types import SimpleNamespace

import pytest
from std_srvs.srv import TriggerRequest

from solfer.components import Component, Service
from solfer.errors import Overtaken
from solfer.middleware.ros import RosMiddleware, middleware, services
from solfer.plugins.generation.config_service import answer_at_once
from solfer.plugins.tuning import Tuning
from solfer.srv import ClaimJointsRequest, GetParametersRequest, SetParametersRequest
from solfer.transport import Inbox
from solfer.transport.lower_level import CLAIM_INTERFACE, ClaimAnswer, ClaimRequest, answered_service
from solfer.transport.middleware import TRIGGER, NoFields


@pytest.fixture
def offered(monkeypatch):
    """Collect what rospy calls with a request, by the name of the service."""
    found = {}

    def offer(name, interface, handler):
        found[name] = handler
        return SimpleNamespace(protocol=None)

    monkeypatch.setattr(services.rospy, "Service", offer)
    monkeypatch.setattr(middleware, "ReconfigureServer", lambda *services: None)
    monkeypatch.setattr(services, "provider", lambda name: None)
    monkeypatch.setattr(services, "bound_requests", lambda *limits, **named: None)
    return found


def test_a_request_is_answered_in_the_next_cycle(offered):
    """The loop makes one cycle for each call that it is passed, so that a reply that needs a second one fails."""
    inbox, cycles, asked = Inbox(), [], []

    def submit(call):
        answer = inbox.submit(call)
        inbox.apply()
        cycles.append(answer.done())
        return answer

    rest = answered_service("rest", TRIGGER, NoFields, work=asked.append, timeout=0.1)
    node = SimpleNamespace(name="/legs", clock=None, running=lambda: True)
    RosMiddleware(node).serve("legs", [rest], submit)
    assert offered["legs/rest"](TriggerRequest()).success
    assert cycles == [True] and asked == [NoFields()]


def test_services_of_parameters_fit_their_types(offered):
    tuning = Tuning(Component(SimpleNamespace(state=SimpleNamespace(position=None))), ())
    node = SimpleNamespace(name="/arm", clock=None, running=lambda: True)
    RosMiddleware(node).serve("arm", [tuning.setting(), tuning.getting()], answer_at_once)
    assert offered["arm/get_parameters"](GetParametersRequest()).success
    reply = offered["arm/set_parameters"](SetParametersRequest(names=["gain"], values=["1"]))
    assert not reply.success and "unknown parameter 'gain'" in reply.message


@pytest.mark.parametrize(("overtaken", "success"), [(2, True), (3, False)])
def test_a_request_that_is_overtaken_is_tried_again(offered, overtaken, success):
    tried = []

    def carry_out(request):
        tried.append(request)
        if len(tried) <= overtaken:
            raise Overtaken("another one was first")

    rest = answered_service("rest", TRIGGER, NoFields, work=carry_out, timeout=0.1)
    node = SimpleNamespace(name="/legs", clock=None, running=lambda: True)
    RosMiddleware(node).serve("legs", [rest], answer_at_once)
    assert offered["legs/rest"](TriggerRequest()).success is success
    assert len(tried) == 3


@pytest.mark.parametrize(
    ("runs", "reason"), [(False, "lower_level ends"), (True, "no answer of its loop within 0.01 s")]
)
def test_a_claim_that_finds_no_lower_level_may_be_repeated(offered, runs, reason):
    """A simulator that ends, or stands still, does not decide on the claim: the plugin waits for the next one."""
    claim = Service("claim", CLAIM_INTERFACE, ClaimRequest, ClaimAnswer, lambda request: ClaimAnswer(), timeout=0.01)
    node = SimpleNamespace(name="/simulator", clock=None, running=lambda: runs)
    RosMiddleware(node).serve("lower_level", [claim], Inbox().submit)
    reply = offered["lower_level/claim"](ClaimJointsRequest(owner="/legs"))
    assert not reply.success and reply.later and reason in reply.message
