"""The nodes that may publish yet delay a start by their clock, and a slow master delays none in lock-step."""

import time

import pytest

from solfer.middleware.ros.node import expected_publishers
from solfer.middleware.ros.node.expected_publishers import ExpectedPublishers
from solfer.transport.endpoints import PUBLISHER_TIMEOUT


@pytest.fixture
def slow_master(monkeypatch):
    """Let the master answer after 0.2 s that `/late` is about to publish."""

    def answer(topic):
        time.sleep(0.2)
        return {"/late"}

    monkeypatch.setattr(expected_publishers, "_registered", answer)


def test_a_cycle_does_not_wait_for_a_slow_master(slow_master):
    watched = ExpectedPublishers("/joint_states", set, now=lambda: 0.0, timeout=0.01)
    assert watched.awaited(()) == [ExpectedPublishers.UNNAMED]
    time.sleep(0.4)
    assert watched.awaited(()) == ["/late"]


def test_a_patient_cycle_has_the_answer_of_a_slow_master(slow_master):
    watched = ExpectedPublishers("/joint_states", set, now=lambda: 0.0, timeout=5.0)
    assert watched.awaited(()) == ["/late"]
    assert watched.awaited(("/late",)) == []


def test_a_node_that_stays_silent_is_awaited_by_the_given_clock(monkeypatch):
    monkeypatch.setattr(expected_publishers, "_registered", lambda topic: set())
    times = iter((0.0, 0.9 * PUBLISHER_TIMEOUT, 1.1 * PUBLISHER_TIMEOUT))
    watched = ExpectedPublishers("/joint_states", lambda: {"/silent"}, now=lambda: next(times), timeout=5.0)
    assert [watched.awaited(()) for _ in range(3)] == [["/silent"], ["/silent"], []]
