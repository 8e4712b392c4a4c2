"""Lock-step of two nodes in one process: clock, follower and conductor, with stand-ins for what rospy sends."""

import threading
from types import SimpleNamespace

import pytest
import rospy

from solfer.errors import ConfigError, MiddlewareError
from solfer.middleware.ros.endpoints import RosReader, RosWriter
from solfer.middleware.ros.lockstep import followers
from solfer.transport.lockstep import client
from solfer.transport.lockstep.client import LockstepCall, LockstepClient, LockstepNetwork
from solfer.transport.lockstep.server import LockstepServer
from solfer.transport.lockstep.step_clock import StepClock
from solfer.transport.waiting import ShutdownRequested

PERIOD = 0.005  # [s]
BOUND = 60.0  # [s]


class SleepingLoop:
    """The loop of a node that sleeps from cycle to cycle, in a thread of its own.

    Attributes:
        times: Its clock in each cycle [s].
    """

    def __init__(self, clock, sleep_until, running):
        self.times, self._clock, self._sleep_until, self._running = [], clock, sleep_until, running
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self):
        self._sleep_until(0.0)
        deadline = self._clock.now()
        while self._running():
            self.times.append(self._clock.now())
            deadline += PERIOD
            self._sleep_until(deadline)


@pytest.fixture
def alive():
    """Event that lets nodes go on; ROS time stays as it is."""
    event = threading.Event()
    event.set()
    yield event
    event.clear()


@pytest.fixture
def loop(alive):
    """Run a loop on a StepClock."""
    clock = StepClock(alive.is_set, lambda time: None)
    made = SleepingLoop(clock, clock.sleep_until, alive.is_set)
    yield made, clock
    alive.clear()
    made.thread.join(BOUND)
    assert not made.thread.is_alive()


def test_a_cycle_is_made_only_when_due(loop):
    made, clock = loop
    assert clock.grant(0.001, lambda: None) == pytest.approx(0.006)
    prepared = []
    assert clock.grant(0.004, lambda: prepared.append(list(made.times))) == pytest.approx(0.006)
    assert made.times == [0.001] and prepared == [] and clock.now() == 0.001
    assert clock.grant(0.006 - 5e-10, lambda: prepared.append(list(made.times))) == pytest.approx(0.011)
    assert made.times == pytest.approx([0.001, 0.006]) and prepared == [[0.001]]  # before the cycle


def test_no_time_passes_when_the_simulation_goes_back(loop):
    made, clock = loop
    clock.grant(1.0, lambda: None)
    assert clock.grant(1.005, lambda: None) == pytest.approx(1.01) and clock.rewinds == 0
    assert clock.grant(0.0, lambda: None) == pytest.approx(0.005)  # in the simulation's own time
    assert clock.rewinds == 1 and clock.now() == pytest.approx(1.005) and len(made.times) == 2
    assert clock.grant(0.005, lambda: None) == pytest.approx(0.01)
    assert made.times == pytest.approx([1.0, 1.005, 1.01]) and clock.rewinds == 1


def test_a_node_that_ends_lets_the_simulation_go(alive):
    clock = StepClock(alive.is_set, lambda time: None)
    alive.clear()
    clock.sleep_until(1.0)
    with pytest.raises(ShutdownRequested):
        clock.grant(1.0, lambda: None)


def writer(topic, number):
    """Make a writer of a node, with `number` messages so far."""
    made = RosWriter.__new__(RosWriter)
    made.topic, made.topic_publisher = (
        topic,
        SimpleNamespace(number=lambda: number[0], receivers=lambda: {"/simulator"}),
    )
    return made


def reader(topic, received):
    """Make a reader of a node, with the newest number of each sender."""
    return SimpleNamespace(
        topic=topic,
        subscription=SimpleNamespace(
            number=lambda sender, before=0: received.get(sender, 0), senders=lambda: {"/simulator"}
        ),
    )


class Network(LockstepNetwork):
    """Stands in for the middleware of all nodes: what answers, by the node's name."""

    def __init__(self):
        self.answers = {}

    def of(self, name):
        """Return the middleware of one node."""
        made = Network()
        made.name, made.answers = name, self.answers
        return made

    def others(self, endpoints):
        """All topics are the simulator's."""
        return [{"/simulator"} for _ in endpoints]

    def offer(self, answer):
        """Keep what answers."""
        self.answers[self.name] = answer
        return lambda: self.answers.pop(self.name)

    def connect(self, node):
        """Return a call if the node answers."""
        return Call(self.answers, node) if node in self.answers else None


class Call(LockstepCall):
    """Calls what answers for a node."""

    def __init__(self, answers, name):
        self._answers, self._name = answers, name

    def __call__(self, tick):
        if self._name not in self._answers:
            raise MiddlewareError("no answer")
        return self._answers[self._name](tick)

    def close(self):
        """Nothing is open."""


class FollowingNode:
    """A node `/arm` that follows: receives `joint_states`, publishes `desired` once in each cycle."""

    def __init__(self, alive, network):
        self.received, self.sent = {}, [0]
        clock = StepClock(alive.is_set, lambda time: None)
        self.follower = LockstepClient(
            network.of("/arm"),
            clock,
            [reader("/joint_states", self.received), writer("/desired", self.sent)],
            lambda: [],
            alive.is_set,
        )
        self.loop = SleepingLoop(clock, self._sleep_until, alive.is_set)

    def _sleep_until(self, deadline):
        if self.loop_has_begun:
            self.sent[0] += 1
        self.follower.sleep_until(deadline)

    @property
    def loop_has_begun(self):
        """Return whether the loop has made a cycle."""
        return hasattr(self, "loop") and bool(self.loop.times)


@pytest.fixture
def network():
    return Network()


@pytest.fixture
def pair(alive, network):
    """Make a node that follows, and the server of a simulator that has published its joints and receives `desired`."""
    node, received, published = FollowingNode(alive, network), {}, [1]
    node.received["/simulator"] = 1
    made = LockstepServer(
        ["/arm"],
        network.of("/simulator"),
        [writer("/joint_states", published), reader("/desired", received)],
        alive.is_set,
    )
    yield SimpleNamespace(node=node, conductor=made, received=received, published=published)
    made.close()
    alive.clear()
    node.loop.thread.join(BOUND)


def join(pair):
    """Wait until the node is there."""
    event = threading.Event()
    for _ in range(round(BOUND / 0.01)):
        if pair.conductor.present():
            return
        event.wait(0.01)
    raise AssertionError("the node does not join")


def test_time_waits_for_the_node_and_its_cycles(pair):
    join(pair)
    pair.received["/arm"] = 1  # what it will have published has arrived
    pair.conductor.follow(0.0, lambda: None)
    assert pair.node.loop.times == [0.0] and pair.node.sent == [1]
    pair.conductor.follow(0.004, lambda: None)  # not due
    assert pair.node.loop.times == [0.0]
    pair.received["/arm"] = 2
    pair.conductor.follow(0.005, lambda: None)
    assert pair.node.loop.times == pytest.approx([0.0, 0.005])


def test_a_cycle_waits_for_earlier_messages(pair, alive):
    join(pair)
    pair.published[0] = 2  # published, not received yet
    pair.received["/arm"] = 1
    done = threading.Thread(target=pair.conductor.follow, args=(0.0, lambda: None))
    done.start()
    done.join(0.1)
    assert done.is_alive() and pair.node.loop.times == []
    pair.node.received["/simulator"] = 2
    done.join(BOUND)
    assert not done.is_alive() and pair.node.loop.times == [0.0]


def test_messages_before_the_node_came_are_not_awaited(alive, network, pair):
    pair.node.received.clear()
    join(pair)
    pair.received["/arm"] = 1
    pair.conductor.follow(0.0, lambda: None)
    assert pair.node.loop.times == [0.0]


def test_a_message_that_does_not_arrive_is_named(pair, monkeypatch):
    monkeypatch.setattr(client, "LOCKSTEP_TIMEOUT", 0.05)
    join(pair)
    with pytest.raises(MiddlewareError, match="message 1 of /arm on topic /desired has not arrived"):
        pair.conductor.follow(0.0, lambda: None)


def test_a_gone_node_is_named_and_may_return(pair, network, caplog):
    join(pair)
    handler = network.answers.pop("/arm")
    pair.conductor.follow(0.0, lambda: None)
    assert "/arm is gone: no answer" in caplog.text and not pair.conductor.present()
    assert "time stands still until /arm is there" in caplog.text
    network.answers["/arm"] = handler
    assert pair.conductor.present()


def test_a_restarted_simulator_goes_on_with_the_node(pair, alive, network):
    """Its counters start at zero while the node's do not: the lock-step must neither hang nor skip a cycle."""
    join(pair)
    pair.received["/arm"] = 1
    pair.conductor.follow(0.0, lambda: None)
    pair.received["/arm"] = 2
    pair.conductor.follow(0.005, lambda: None)
    received = {}  # nothing of what the one before received
    pair.conductor.close()
    pair.published[0], pair.node.received["/simulator"] = 1, 1
    pair.conductor = LockstepServer(
        ["/arm"],
        network.of("/simulator"),
        [writer("/joint_states", pair.published), reader("/desired", received)],
        alive.is_set,
    )
    join(pair)
    pair.conductor.follow(0.0, lambda: None)
    assert pair.node.loop.times == pytest.approx([0.0, 0.005])  # no time has passed
    received["/arm"] = 3
    pair.conductor.follow(0.005, lambda: None)
    assert pair.node.loop.times == pytest.approx([0.0, 0.005, 0.01])


@pytest.mark.parametrize("value, names", [("", ()), ("arm", ("/arm",)), (" arm , /other/leg,", ("/arm", "/other/leg"))])
def test_the_parameter_names_the_followers(monkeypatch, value, names):
    monkeypatch.setattr(rospy, "get_param", lambda name, default: value)
    assert followers() == names


@pytest.mark.parametrize("value, error", [(["arm"], "not a list of nodes"), ("arm, /arm", "a node twice")])
def test_a_wrong_lockstep_parameter_is_refused(monkeypatch, value, error):
    monkeypatch.setattr(rospy, "get_param", lambda name, default: value)
    with pytest.raises(ConfigError, match=error):
        followers()


def arrives(reader, sender, connection):
    """Let a message arrive on a connection."""
    connection["callerid"] = sender
    reader.subscription._receive(SimpleNamespace(_connection_header=connection, packed=bytes(8)))


def test_messages_without_a_header_are_counted(monkeypatch):
    monkeypatch.setattr(rospy, "Subscriber", lambda topic, *given, **more: SimpleNamespace(resolved_name=topic))
    reader, first, second = RosReader("/pace", "std_msgs/Float64"), {}, {}
    number = reader.subscription.number
    assert number("/driver") == 0 and number("/driver", 7) == 7
    for _ in range(3):
        arrives(reader, "/driver", first)
    arrives(reader, "/other", {})
    assert number("/driver") == 3 and number("/driver", 7) == 10 and number("/other") == 1
    arrives(reader, "/driver", second)  # it was started again
    assert number("/driver") == 1
