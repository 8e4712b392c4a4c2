"""Tests of pipes whose two ends are in one shared space: numbers arrive at once, and what does not fit is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.contract import ALL, NAMED

from solfer.errors import SolferError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins.sharing.ends import check_ends
from solfer.plugins.sharing.member import SpaceMember
from solfer.plugins.sharing.space import SharedSpace, SharedTopic
from solfer.transport import MessageStatus

every_pipe = pytest.mark.parametrize("case", ALL.values(), ids=ALL)
pipes_with_names = pytest.mark.parametrize("case", NAMED.values(), ids=NAMED)


class Pair:
    """Two components of a shared plugin: the first publishes on `topic` what the second receives."""

    def __init__(self, kind):
        space, bus = SharedSpace([SharedTopic("first", "topic", kind, "a.yaml:7:3")]), Bus()
        self.first, self.second = (
            SimpleNamespace(middleware=SpaceMember(name, space, MemoryMiddleware(bus, "node")))
            for name in ("first", "second")
        )

    def prepare(self, kind, message):
        """Prepare another message than a pipe of that kind would."""
        self.first.middleware.writer("topic", kind).prepare(message)


@every_pipe
def test_numbers_arrive_in_the_same_cycle(case):
    pair = Pair(case.kind)
    sender, receiver = case.publish(pair.first, "topic"), case.listen(pair.second, "/topic")
    check_ends([(receiver.pipe, "a.yaml:9:3")], [sender.pipe])
    numbers = np.random.default_rng(1).uniform(-1.0, 1.0, case.size)
    sender.numbers[:] = numbers
    sender.pipe.collect()
    sender.pipe.send(2.5)
    assert receiver.pipe.run() is MessageStatus.NEW and receiver.pipe.received
    assert_allclose(receiver.numbers, numbers, atol=1e-12)


@every_pipe
def test_ends_that_do_not_fit_are_refused(case):
    pair = Pair(case.kind)
    receiver = case.listen(pair.second, "topic")
    message, reason = case.unknown()
    pair.prepare(case.kind, message)
    with pytest.raises(SolferError) as refused:
        check_ends([(receiver.pipe, "a.yaml:9:3")], [])
    text = str(refused.value)
    assert reason in text and "'first'" in text and "a.yaml:7:3" in text and text.startswith("a.yaml:9:3: ")


@pipes_with_names
def test_a_missing_name_would_be_missed(case):
    pair = Pair(case.kind)
    receiver = case.listen(pair.second, "topic")
    width = case.size // len(case.names)
    pair.prepare(case.kind, case.message(np.zeros(width * (len(case.names) - 1)), case.names[1:]))
    with pytest.raises(SolferError, match=f"lacks the .*{case.names[0]}"):
        check_ends([(receiver.pipe, "a.yaml:9:3")], [])


def test_interfaces_have_to_be_sent():
    pair, added = Pair(ALL["joint"].kind), ALL["added"]
    sender, receiver = ALL["joint"].publish(pair.first, "topic"), added.listen(pair.second, "topic")
    with pytest.raises(SolferError, match="'velocity' is not sent, only position"):
        check_ends([(receiver.pipe, "a.yaml:9:3")], [sender.pipe])


def test_quantities_have_to_agree():
    velocity = type(ALL["points"])()
    velocity.quantity, velocity.record = "velocity", {**velocity.record, "quantity": "velocity"}
    pair = Pair(velocity.kind)
    sender, receiver = ALL["points"].publish(pair.first, "topic"), velocity.listen(pair.second, "topic")
    with pytest.raises(SolferError, match="carries the quantity 'force'"):
        check_ends([(receiver.pipe, "a.yaml:9:3")], [sender.pipe])
