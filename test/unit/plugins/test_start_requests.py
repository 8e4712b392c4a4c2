"""Requests to the lower level at each start: which, and what is said of refusals."""

import pytest
from support.unit.joint_pipes import published

from solfer.config import TextRecord
from solfer.errors import PipeError
from solfer.interfaces.declaration import Service
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins.outputs.start_requests import REQUEST_PATIENCE, StartRequests, requests_of
from solfer.transport import Inbox
from solfer.transport.lower_level import LOAD_GAINS, SWITCH_FEED_FORWARD, Answer, FileRequest
from solfer.transport.middleware import Flag


def asked(gains=None, **tags):
    """List what a pipe to the lower level asks for."""
    record = published(**{"name": "arm", "type": "impedance", "sink": "/command", **tags})
    return [tuple(request) for request in requests_of([record], gains)]


def test_each_pipe_asks_for_its_own(tmp_path):
    """Which services are called follows from the pipe's tags: gains only of impedance, unless a service is named."""
    file = tmp_path / "gains.yaml"
    gains, load = (
        TextRecord(path=str(tmp_path), file="gains.yaml"),
        (LOAD_GAINS, FileRequest(str(file)), f"load {file}"),
    )
    switch = (SWITCH_FEED_FORWARD, Flag(True), "switch feed-forward torques on")
    assert asked() == [] and asked(TextRecord(path="/gains")) == []
    assert asked(ff_service="/set_ff") == [("arm/set_ff", *switch)]
    assert asked(gains) == [("arm/load_gains", *load)]
    assert asked(gains, ff_service="set_ff", load_service="/load") == [("arm/set_ff", *switch), ("arm/load", *load)]
    wheel = {"type": "velocity", "interface": {"velocity": True}}
    assert asked(gains, **wheel) == [] and asked(gains, **wheel, load_service="l") == [("arm/l", *load)]
    with pytest.raises(PipeError) as error:
        asked(TextRecord(parameter="gains"))
    assert (error.value.what, error.value.expected) == ("gains in a parameter", "file: FILE")


def test_refusals_are_logged_and_change_nothing(caplog):
    """A lower level that refuses or does not answer must not keep the plugin from starting."""
    bus, inbox, got = Bus(), Inbox(), []

    def switch(flag):
        got.append(flag)
        return Answer(len(got) < 2, "too hot")

    service = Service("set_ff", SWITCH_FEED_FORWARD, Flag, Answer, switch)
    MemoryMiddleware(bus, "robot").serve("arm", [service], inbox.submit)
    record = published(name="arm", type="impedance", sink="/command", ff_service="set_ff")
    requests = StartRequests("cart", MemoryMiddleware(bus, "cart"), list(requests_of([record], None)))
    for messages in ([], ["cart: arm/set_ff does not switch feed-forward torques on: too hot"]):
        requests.send()
        inbox.apply()
        assert caplog.messages == messages
    assert got == [Flag(True)] * 2
    lost = published(name="leg", type="impedance", sink="/command", ff_service="set_ff")
    StartRequests("cart", MemoryMiddleware(bus, "cart"), list(requests_of([lost], None))).send()
    bus.run_until(2.0 * REQUEST_PATIENCE)
    assert caplog.messages[1].startswith("cart: leg/set_ff does not switch feed-forward torques on: ")
