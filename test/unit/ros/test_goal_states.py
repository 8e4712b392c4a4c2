"""Goals of a declared action have the states that actionlib's own server gives them."""

import itertools

import actionlib.action_server
import pytest
import rospy
from support.unit.goal_sequences import EVENTS, Clients, endless_action, reference_server, ros_message, states

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport.declared.action_server import ActionServer
from solfer.transport.declared.fields import message_of, value_of
from solfer.transport.declared.goals import GOAL_ID, STATUS, GoalName, GoalStatus, StatusList, envelopes, interface_of

TICK = 1.0
"""Time between two events [s], less than actionlib's server remembers a goal that has ended."""


class Endpoint:
    """A publisher, subscriber or timer without a graph."""

    def __init__(self, *_, **__):
        self.published = None

    def publish(self, message):
        """Keep a message."""
        self.published = message


@pytest.fixture
def graphless(monkeypatch):
    """Let actionlib's server work without a graph; returns what sets its time [s]."""
    for name in ("Publisher", "Subscriber", "Timer"):
        monkeypatch.setattr(actionlib.action_server.rospy, name, Endpoint)
    monkeypatch.setattr(rospy, "get_param", lambda name, default=None: default)
    monkeypatch.setattr(rospy, "has_param", lambda name: False)
    monkeypatch.setattr(rospy, "search_param", lambda name: None)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)

    def set_time(now):
        monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time.from_sec(now))

    return set_time


class Theirs:
    """actionlib's server."""

    def __init__(self, set_time):
        set_time(TICK)
        self._set_time, self._server = set_time, reference_server("reference").action_server

    def receive(self, now, topic=None, name=None):
        """Let a message arrive, or only time pass; return the states of all goals."""
        self._set_time(now)
        if topic == "goal":
            self._server.internal_goal_callback(ros_message(topic, name))
        elif topic == "cancel":
            self._server.internal_cancel_callback(ros_message(topic, name))
        self._server.publish_status()
        return states(self._server.status_pub.published.status_list)


class Ours:
    """The server of solfer."""

    def __init__(self):
        self._bus, action = Bus(), endless_action("ours")
        self._action = action
        self._bus.run_until(TICK)
        self._server = ActionServer("node", action, MemoryMiddleware(self._bus, "node"))
        self._goal = interface_of(action.interface, "goal")
        self._types = envelopes(action.goal, action.feedback, action.result)
        client = MemoryMiddleware(self._bus, "client")
        self._topics = {
            "goal": client.writer("node/ours/goal", self._goal),
            "cancel": client.writer("node/ours/cancel", GOAL_ID),
        }
        self._status, self._states = client.declared_queue("node/ours/status", STATUS), {}

    def receive(self, now, topic=None, name=None):
        """See `Theirs.receive`."""
        self._bus.run_until(now)
        if topic == "goal":
            self._topics[topic].write(message_of(self._goal, self._types.goal(name, self._action.goal())))
        elif topic == "cancel":
            self._topics[topic].write(message_of(GOAL_ID, name))
        self._server.receive("")
        self._server.publish()
        for message in self._status.drain():
            self._states = states(value_of(StatusList, message).status_list)
        return self._states


def different(sequence, theirs, ours):
    """Return where the states of goals differ in a sequence that begins with a goal; None: nowhere."""
    clients = Clients(TICK)
    for step, event in enumerate(("goal", *sequence)):
        now = TICK * (step + 2)
        sent = clients.act(event, now)
        expected, found = (server.receive(now, *(sent or ())) for server in (theirs, ours))
        if expected != found:
            return sequence[:step], expected, found
    return None


@pytest.mark.slow
def test_sequences_of_three_events_have_the_states_of_actionlib(graphless):
    for sequence in itertools.product(EVENTS, repeat=3):
        assert different(sequence, Theirs(graphless), Ours()) is None


def test_time_that_begins_again_forgets_stamps():
    ours = Ours()
    ours.receive(100.0, "goal", GoalName(100.0, "old"))
    ours.receive(101.0, "cancel", GoalName(101.0))
    ours._server._stamp_time = lambda: 1.0
    assert ours.receive(102.0, "goal", GoalName(1.0, "new"))["new"] == GoalStatus.ACTIVE
