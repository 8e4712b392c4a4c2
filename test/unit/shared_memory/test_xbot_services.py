"""Services in shared memory: calls between two cycles, each with a reply."""

import math
import threading
from dataclasses import replace

import numpy as np
import pytest
from support.plugins.fleet import Fleet, still
from support.recording.sine import tree
from support.unit.refusals import check_refusal
from support.unit.shared_world import Scale, Scaled, SharedWorld, ask, scale

from solfer.components import Service
from solfer.errors import ComponentError, MiddlewareError, ServiceUnavailable
from solfer.interfaces.declaration import Accepted
from solfer.middleware.shared_memory.rpc import channel as channel_module
from solfer.middleware.shared_memory.rpc.channel import unpacked
from solfer.plugins.generation.config_service import answer_at_once
from solfer.transport import Inbox
from solfer.transport.middleware import JOINT_NAMES, JointNames, NoFields
from solfer.transport.parameters import GetParameters, ParametersReply, SetParameters


@pytest.fixture
def world(tmp_path):
    return SharedWorld(tmp_path)


def test_a_call_is_answered_between_two_cycles(world):
    world.serve(scale)
    reply = ask(world.node("client"), (1.0, 1e-300, math.inf), title="h\u00f6he")
    assert reply == Scaled(True, "h\u00f6he", (2.0, 2e-300, math.inf))


def test_replies_belong_to_their_calls(world):
    world.serve(scale)
    clients = [world.node(name) for name in ("one", "two")]
    answers = [
        client.request("/scaler/scale", "test/Scale", Scale((float(index),), 10.0), Scaled, 5.0)
        for index in range(12)
        for client in clients
    ]
    for _ in range(100):
        world.bus.run_until(world.bus.time + 0.002)
        for client in clients:
            client.poll()
    assert [answer.result(0).numbers for answer in answers] == [(10.0 * (index // 2),) for index in range(24)]


def test_a_service_that_comes_later_is_asked(world):
    client = world.node("client")
    answer = client.request("scaler/scale", "test/Scale", Scale((1.0,)), Scaled, 1.0)
    client.sleep_until(0.5)
    world.serve(scale)
    client.sleep_until(0.6)
    client.sleep_until(0.7)
    assert answer.result(0).numbers == (1.0,)


LATE = ComponentError("it is late", where="here", expected="an earlier call")


@pytest.mark.parametrize("fault", [LATE, ValueError("bad")], ids=["solfer", "other"])
def test_the_caller_gets_an_error_of_the_handler(world, fault):
    def handler(_):
        raise fault

    world.serve(handler)
    reply = ask(world.node())
    assert not reply.success and str(fault) in reply.message


def test_the_caller_gets_a_refusal_of_the_loop(world):
    world.serve(scale, refusal="plugin 'scaler' waits")
    assert ask(world.node()) == Scaled(False, "plugin 'scaler' waits")


def test_the_caller_learns_that_no_loop_runs(world):
    server = world.node("server")
    server.serve("scaler", [Service("scale", "test/Scale", Scale, Scaled, scale, 0.5)], Inbox().submit)
    world.bus.every(0.001, server.poll)
    reply = ask(world.node(), timeout=2.0)
    assert not reply.success and "scaler does not run" in reply.message
    assert 0.5 <= world.bus.time < 0.6


def test_long_preparation_runs_in_another_thread(world):
    threads = []

    def prepare(request):
        threads.append(threading.current_thread())
        return Scale(request.numbers, 3.0)

    def handler(request):
        threads.append(threading.current_thread())
        return scale(request)

    world.serve(handler, prepare=prepare, timeout=1e6)
    assert ask(world.node(), (1.0,), timeout=1e6).numbers == (3.0,)
    assert threads[0] is not threads[1] and threads[1] is threading.current_thread()


def test_a_service_without_an_offer_is_unavailable(world):
    world.serve(scale)
    with pytest.raises(ServiceUnavailable) as refusal:
        world.node().call("scaler/scael", "test/Scale", Scale((1.0,)), Scaled, 0.1)
    assert refusal.value.names == ("scaler/scale",)
    with pytest.raises(MiddlewareError, match="lower-level controller 'legs' does not name its joints"):
        world.node().controller_joints("legs", 0.1)


def test_a_withdrawn_service_is_not_called(world):
    server, _ = world.serve(scale)
    client = world.node()
    assert ask(client).success
    server.close()
    with pytest.raises(ServiceUnavailable):
        ask(client, timeout=0.1)


def test_a_service_is_offered_once(world):
    world.serve(scale)
    with pytest.raises(MiddlewareError, match="writes here already"):
        world.serve(scale)


def test_a_service_of_another_interface_is_not_asked(world):
    world.serve(scale)
    with pytest.raises(MiddlewareError, match="test/Scale") as refusal:
        world.node().call("scaler/scale", JOINT_NAMES, NoFields(), JointNames, 0.1)
    assert JOINT_NAMES in refusal.value.expected


@pytest.mark.parametrize("where", ["request", "reply"])
def test_what_is_too_long_is_an_error(world, where):
    size = {"request": channel_module.REQUEST_SIZE, "reply": channel_module.REPLY_SIZE}[where]
    world.serve(scale if where == "request" else lambda _: Scaled(message="x" * size))
    with pytest.raises(MiddlewareError, match="bytes do not fit"):
        ask(world.node(), title="x" * size if where == "request" else "")


def test_numbers_of_numpy_are_numbers(world):
    world.serve(lambda request: Scaled(np.bool_(True), "", np.array(request.numbers)))
    assert ask(world.node(), np.array([1.5, 2.5])).numbers == (1.5, 2.5)


def test_a_call_the_client_gave_up_is_dropped(world):
    done = []
    server, inbox = world.node("server"), Inbox()
    server.serve("scaler", [Service("scale", "test/Scale", Scale, Scaled, done.append)], inbox.submit)
    client = world.node("client")
    with pytest.raises(MiddlewareError, match="does not answer"):
        ask(client, timeout=0.1)
    server.poll()
    inbox.apply()
    assert done == []


def test_segments_of_ended_clients_are_removed(world):
    world.serve(scale)
    client = world.node("client")
    assert ask(client).success
    calls = world.node().namespace.path("services", "scaler/scale", "calls")
    assert sorted(file.name[:6] for file in calls.iterdir()) == ["client", "client"]  # the segment and its lock
    client._calls._channels.popitem()[1].segment._lock.release()  # as after kill -9
    other = world.node("other")
    assert ask(other).success
    assert sorted(file.name[:5] for file in calls.iterdir()) == ["other", "other"]
    other.close()
    assert list(calls.iterdir()) == []


def test_a_client_that_comes_back_at_once_is_answered(world):
    """Its server has not looked since the client of that name ended."""
    world.serve(scale)
    for _ in range(2):
        client = world.node("client")
        assert ask(client).success
        client.close()


def test_parameters_of_a_plugin_travel(world, tmp_path):
    """What is described and changed in shared memory is what a plugin has."""
    changed = tree("support.plugins.tuned:Tuned")
    fleet = Fleet(tmp_path, changed, ("first",), together=False)
    fleet.cycle(**still())
    tuning, node, inbox = fleet.plugins[0].tuning, world.node("server"), Inbox()
    # the clock is virtual, the thread that prepares is not
    setting_service, getting_service = (replace(each, timeout=1e4) for each in (tuning.setting(), tuning.getting()))
    node.serve("first", [setting_service], inbox.submit_one_by_one)
    node.serve("first", [getting_service], answer_at_once)
    world.bus.every(0.002, lambda: (node.poll(), inbox.apply()))
    client = world.node("client")
    setting = SetParameters(("gain",), ("1.5",))
    assert client.call("first/set_parameters", "solfer/SetParameters", setting, Accepted, 1e4).success
    reply = client.call("first/get_parameters", "solfer/GetParameters", GetParameters(("gain",)), ParametersReply, 1e4)
    assert (reply.values, reply.units) == (("1.5",), ("1/s",))


def test_callers_learn_why_there_is_no_reply(world):
    client = world.node("client")
    words = "no node offers the service 'scaler/scale' (waited 0.25 s)"
    check_refusal(lambda: ask(client, timeout=0.25), ServiceUnavailable, "", words)
    world.node("server").serve("scaler", [Service("scale", "test/Scale", Scale, Scaled, scale)], Inbox().submit)
    words = "does not answer (waited 0.25 s) (expected: an owner that runs"
    check_refusal(lambda: ask(client, timeout=0.25), MiddlewareError, "", words)


def test_callers_that_end_say_so(world, monkeypatch):
    client = world.node("client")
    answer = client.request("scaler/scale", "test/Scale", Scale((1.0,)), Scaled, 1.0)
    client.close()
    other = world.node("other")
    monkeypatch.setattr(other, "running", lambda: False)
    for call in (answer.result, lambda: ask(other)):
        check_refusal(call, MiddlewareError, "", "the caller of service 'scaler/scale' ends")


def test_what_cannot_travel_is_named(world):
    world.serve(lambda _: Scaled(message=object()))
    for call, words in (
        (lambda: ask(world.node("client"), title=object()), "a object cannot be sent"),
        (lambda: ask(world.node("other")), "its reply cannot be sent: a object cannot be sent"),
        (lambda: unpacked(Scale, {"number": 1, "text": 2}), "Scale cannot be made of number, text"),
    ):
        check_refusal(call, MiddlewareError, "", words)
