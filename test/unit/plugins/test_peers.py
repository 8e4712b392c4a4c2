"""Missing peers of pipes are reported in the log and in the plugin's health."""

import logging
from concurrent.futures import Future

import pytest
from support.unit.joint_pipes import RATE, make_robot, published, received

from solfer.errors import MiddlewareError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.pipes.sharing.local_topic import LocalReader, LocalTopic, LocalWriter
from solfer.plugins.peers import Peer, Peers
from solfer.plugins.sharing.member import SpaceMember
from solfer.plugins.sharing.space import SharedSpace, SharedTopic

KIND = "solfer/JointCommand"


class Looking:
    """A pipe of a node on a bus with others; its peers are looked for ten times a second."""

    def __init__(self):
        self.bus = Bus()
        self.node, self.other = MemoryMiddleware(self.bus, "cart"), MemoryMiddleware(self.bus, "other")
        self.context = PipeContext(make_robot(), self.node, {}, RATE)
        self.peers, self.asked = None, 0

    def receive(self, topic, needed=True):
        """Look for the publisher of a topic."""
        self._look(factory.feedback(received(source=topic), self.context), needed)

    def publish(self, topic, needed=True):
        """Look for the subscriber of a topic."""
        self._look(factory.controller(published(sink=topic), self.context), needed)

    def _look(self, pipe, needed):
        self.peers = Peers("cart", [Peer(pipe, "cart.yaml:7:3", needed)], self.node)
        self.bus.every(0.1, self.peers.look)

    def after(self, seconds):
        """Let time pass."""
        self.bus.run_until(self.bus.time + seconds)


@pytest.fixture
def looking(caplog):
    caplog.set_level(logging.INFO, "solfer")
    return Looking()


def test_a_missing_publisher_is_warned_about_again(looking, caplog):
    """The warning waits a second, suggests similar names, repeats every 10 s, and its end is logged."""
    looking.other.writer("goals", KIND)
    looking.other.writer("gaols_of_others", "sensor_msgs/JointState")
    looking.other.writer("wrenches", "sensor_msgs/JointState")
    looking.receive("gaols")
    looking.after(0.9)
    assert not caplog.messages and looking.peers.warning() == ""
    looking.after(0.3)
    line = "no publisher on gaols (feedback 'pipe', cart.yaml:7:3); did you mean goals, gaols_of_others?"
    assert caplog.messages == [f"cart: {line}"] and looking.peers.warning() == line
    looking.after(20.0)
    assert caplog.messages == [f"cart: {line}"] * 3
    looking.other.writer("gaols", KIND)
    looking.after(1.2)
    assert caplog.messages[3:] == [f"cart: resolved: {line}"]
    looking.after(1.2)
    assert looking.peers.warning() == "" and looking.peers.done


def test_a_missing_subscriber_suggests_any_fitting_topic(looking, caplog):
    looking.other.reader("zzz", KIND)
    looking.other.writer("comand", KIND)  # another publisher is not a subscriber
    looking.publish("comand")
    looking.after(1.2)
    assert caplog.messages == ["cart: no subscriber on comand (controller 'pipe', cart.yaml:7:3); did you mean zzz?"]


def test_an_optional_peer_is_warned_about_once(looking, caplog):
    looking.publish("desired", needed=False)
    looking.after(4.9)
    assert not caplog.messages
    looking.other.writer("desires", KIND)
    looking.after(30.0)
    assert caplog.messages == ["cart: no subscriber on desired (controller 'pipe', cart.yaml:7:3)"]
    assert looking.peers.warning() == "" and not looking.peers.done  # replies to requests say it


@pytest.mark.parametrize("after", [2.0, 10.0])
@pytest.mark.parametrize("is_received", [False, True])
def test_a_request_without_a_receiver_is_a_warning(looking, caplog, is_received, after):
    """Also before the topic itself is warned about, and not if a subscriber has come since."""
    looking.publish("desired", needed=False)
    looking.after(after)
    if is_received:
        looking.other.reader("desired", KIND)
        looking.after(1.2)
    caplog.clear()
    reply = looking.peers.note_request("trajectory")
    looking.after(0.2)
    line = "no subscriber on desired (controller 'pipe', cart.yaml:7:3)"
    expected = f"no node receives what it publishes: {line}"
    assert reply == ("" if is_received else expected) and looking.peers.done == is_received
    assert caplog.messages == ([] if is_received else [f"cart carries out 'trajectory', but {expected}"])


def test_a_present_peer_is_looked_for_once(looking, caplog, monkeypatch):
    asked, topics = [], MemoryMiddleware.topics
    monkeypatch.setattr(MemoryMiddleware, "topics", lambda node: asked.append(node) or topics(node))
    looking.other.reader("desired", KIND)
    looking.publish("desired")
    looking.after(30.0)
    assert not caplog.messages and asked == [looking.node] and looking.peers.done


def test_a_missing_peer_is_looked_for_each_second(looking, monkeypatch):
    asked, topics = [], MemoryMiddleware.topics
    monkeypatch.setattr(MemoryMiddleware, "topics", lambda node: asked.append(node) or topics(node))
    looking.receive("goals")
    looking.after(20.05)
    assert 15 <= len(asked) <= 20 and not looking.peers.done


def test_a_failed_look_blames_no_peer(looking, caplog, monkeypatch):
    def fail(node):
        answer = Future()
        answer.set_exception(MiddlewareError("the master does not answer"))
        return answer

    monkeypatch.setattr(MemoryMiddleware, "topics", fail)
    looking.receive("gaols")
    looking.after(3.0)
    assert not caplog.messages and looking.peers.warning() == "the master does not answer"


def test_a_missing_joint_order_warns_after_a_second(looking, caplog):
    looking.other.writer("joint_states", KIND)
    with pytest.raises(MiddlewareError, match="nothing on topic 'joint_stats' within 5 s: no publisher") as failure:
        looking.node.joint_order("joint_stats", KIND, 5.0, "cart.yaml:7:3")
    assert caplog.messages == ["cart.yaml:7:3: no publisher on joint_stats; did you mean joint_states?"]
    assert failure.value.names == ("joint_states",) and looking.bus.time == pytest.approx(5.0)


@pytest.mark.parametrize("is_received", [True, False])
def test_what_the_same_process_receives_counts(looking, caplog, is_received):
    space = SharedSpace([SharedTopic("cart", "desired", KIND)])
    looking.context = PipeContext(make_robot(), SpaceMember("cart", space, looking.node), {}, RATE)
    looking.publish("desired", needed=False)
    if is_received:
        SpaceMember("other", space, looking.other).reader("desired", KIND)
    looking.after(20.0)
    assert len(caplog.messages) == 1 - is_received and looking.peers.done == is_received


def test_what_is_written_into_a_shared_robot_is_received(looking):
    written = LocalTopic("cart")
    writer = LocalWriter(looking.node.writer("desired", KIND), written, looking.node.now)
    assert not writer.is_received
    LocalReader("desired", written, looking.node.now)
    assert writer.is_received
    space = SharedSpace([SharedTopic("cart", "desired", KIND)])
    member = SpaceMember("cart", space, looking.node)
    shared = LocalWriter(member.writer("desired", KIND), LocalTopic("cart"), member.now)
    assert not shared.is_received
    SpaceMember("other", space, looking.other).reader("desired", KIND)
    assert shared.is_received
