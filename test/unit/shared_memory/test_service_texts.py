"""What callers of services in shared memory receive, word for word."""

from dataclasses import dataclass

import pytest
from support.unit.shared_world import Scale, Scaled, SharedWorld, ask, scale

from solfer.components import Service
from solfer.errors import ComponentError, MiddlewareError
from solfer.middleware.shared_memory.rpc.channel import unpacked
from solfer.transport import Inbox
from solfer.transport.middleware import JOINT_NAMES, JointNames, NoFields


@dataclass(frozen=True)
class Other:
    number: int


@pytest.fixture
def world(tmp_path):
    return SharedWorld(tmp_path)


def refusal(call):
    with pytest.raises(MiddlewareError) as error:
        call()
    return error.value.what, error.value.expected


def test_an_error_says_what_was_expected(world):
    def handler(_):
        raise ComponentError("it is late", where="here", expected="an earlier call")

    world.serve(handler)
    assert ask(world.node()).message == "here: it is late\n  expected: an earlier call"


def test_callers_learn_why_there_is_no_reply(world):
    client = world.node("client")
    assert refusal(lambda: ask(client, timeout=0.25)) == (
        "no node offers the service 'scaler/scale' (waited 0.25 s)",
        "",
    )
    server = world.node("server")
    server.serve("scaler", [Service("scale", "test/Scale", Scale, Scaled, scale)], Inbox().submit)
    assert refusal(lambda: ask(client, timeout=0.25)) == (
        "service 'scaler/scale' does not answer (waited 0.25 s)",
        "an owner that runs; one that is held up does not answer",
    )
    what, expected = refusal(lambda: client.call("scaler/scale", JOINT_NAMES, NoFields(), JointNames, 0.1))
    fields = '["factor", "numbers", "title"], ["message", "numbers", "success"]'
    assert what == f"service 'scaler/scale' is [\"test/Scale\", {fields}]" and JOINT_NAMES in expected


def test_callers_that_end_say_so(world, monkeypatch):
    client = world.node("client")
    ends = "the caller of service 'scaler/scale' ends", "a caller that runs until the answer is there"
    answer = client.request("scaler/scale", "test/Scale", Scale((1.0,)), Scaled, 1.0)
    client.close()
    assert refusal(answer.result) == ends
    client = world.node("other")
    monkeypatch.setattr(client, "running", lambda: False)
    assert refusal(lambda: ask(client)) == ends


def test_what_cannot_travel_is_named(world):
    world.serve(scale)
    client = world.node()
    assert refusal(lambda: ask(client, title=object())) == (
        "a object cannot be sent",
        "numbers, texts and lists of them",
    )
    assert refusal(lambda: unpacked(Other, {"name": 1, "text": 2})) == (
        "Other cannot be made of name, text",
        "the fields number",
    )
    assert unpacked(Other, {"number": [1, 2]}) == Other((1, 2))


def test_a_reply_that_cannot_be_sent_is_an_error(world):
    world.serve(lambda _: Scaled(message=object()))
    what, _ = refusal(lambda: ask(world.node()))
    assert what == (
        "service 'scaler/scale' fails: its reply cannot be sent: "
        "a object cannot be sent (expected: numbers, texts and lists of them)"
    )
