"""At most one living node publishes the time."""

import pytest
import rosgraph

from solfer.errors import MiddlewareError
from solfer.middleware.ros.node import master


@pytest.mark.parametrize("answer, lives", [(1, True), (TimeoutError(), True), (ConnectionRefusedError(), False)])
@pytest.mark.parametrize("own", ["/first", "/second", "/third"])
@pytest.mark.parametrize("registered", [["/first"], ["/first", "/second"], ["/first", "/third", "/second"]])
def test_the_first_living_publisher_is_named(monkeypatch, answer, lives, registered, own):
    def ask(uri, method):
        if isinstance(answer, Exception):
            raise answer
        return answer

    monkeypatch.setattr(master, "graph", lambda: master.Graph({"/clock": registered}, {}, {}))
    monkeypatch.setattr(master, "call_master", lambda method, node: f"http://{node}")
    monkeypatch.setattr(master, "call", ask)
    if own == "/first" or not lives:
        master.refuse_second("/clock", own)
        return
    with pytest.raises(MiddlewareError, match="/first publishes /clock already.*\n.*rosnode kill /first"):
        master.refuse_second("/clock", own)


def test_a_publisher_that_the_master_forgets_is_none(monkeypatch):
    def call_master(method, node):
        raise rosgraph.MasterError("unknown node")

    monkeypatch.setattr(master, "graph", lambda: master.Graph({"/clock": ["/first"]}, {}, {}))
    monkeypatch.setattr(master, "call_master", call_master)
    master.refuse_second("/clock", "/second")
