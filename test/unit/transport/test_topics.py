"""Topics that a component declares, in memory and in shared memory, with and without a header."""

from functools import partial

import pytest
from support.unit.declarations import Header, Twist, TwistStamped, Vector
from support.unit.wires import MemoryWire, XbotWire

from solfer.components import TopicIn, TopicOut
from solfer.errors import ComponentError, MiddlewareError
from solfer.interfaces.geometry import ForceAndTorque, StampedWrench
from solfer.interfaces.geometry import Header as Stamp
from solfer.interfaces.geometry import Vector as Coordinates
from solfer.interfaces.ground import GroundEstimate
from solfer.transport import Inbox
from solfer.transport.declared.binding import bind
from solfer.transport.declared.publications import Publications
from solfer.transport.declared.topics import SoleSender

KINDS = {
    "geometry_msgs/Twist": Twist,
    "geometry_msgs/TwistStamped": TwistStamped,
    "geometry_msgs/WrenchStamped": StampedWrench,
    "solfer/Ground": GroundEstimate,
}
TWIST = Twist(Vector(1.0, 2.0, 3.0), Vector(z=0.5))
VALUES = {
    "geometry_msgs/Twist": (TWIST, Twist(), TWIST),
    "geometry_msgs/TwistStamped": (
        TwistStamped(Header(7.0, "world"), TWIST),
        TwistStamped(Header(8.0, "world")),
        TwistStamped(Header(9.0, "world"), TWIST),
    ),
    "geometry_msgs/WrenchStamped": (
        StampedWrench(Stamp(7.0, "wheel_1"), ForceAndTorque(Coordinates(1.0, -2.0, 230.0), Coordinates(0.1, 0.2, 0.3))),
        StampedWrench(Stamp(8.0, "wheel_1")),
    ),
    "solfer/Ground": (
        GroundEstimate(
            Stamp(7.0, "odom"),
            ("left", "right"),
            (Coordinates(0.5, 0.3, 0.1), Coordinates(0.5, -0.3, 0.1)),
            (Coordinates(-0.6, 0.0, 0.8), Coordinates(0.0, 0.0, 1.0)),
            (0.01, 0.02),
            (0.001, 0.002),
            friction=(0.4, 0.8),
            point=Coordinates(0.5, 0.0, 0.1),
            normal=Coordinates(0.0, -0.28, 0.96),
        ),
        GroundEstimate(),
    ),
}


@pytest.fixture(params=[MemoryWire, XbotWire], ids=["memory", "shared_memory"])
def wire(request):
    wire = request.param()
    yield wire
    wire.close()


@pytest.mark.parametrize("interface", KINDS)
def test_each_message_comes_in_its_order(wire, interface):
    (first, *others), kind = VALUES[interface], KINDS[interface]
    got, inbox, waiting = [], Inbox(), [first, None, *others]
    bind("base", (TopicIn("twist", interface, kind, got.append),), wire.middleware, inbox, rate=100.0)
    sender = wire.node("sender")
    topic = TopicOut("/base/twist", interface, kind, lambda: waiting.pop(0))
    publications = bind("stick", (topic,), sender, Inbox(), rate=100.0)
    while waiting:
        publications.run()
    inbox.apply()
    assert got == [first, *others]


def test_a_stream_has_one_sender(caplog):
    """On whichever of its topics: the first counts until it is silent, and the log names both."""
    wire, inbox, got = MemoryWire(), Inbox(), {"left": [], "right": []}
    topics = [TopicIn(name, "geometry_msgs/Twist", Twist, got[name].append, stream="speed") for name in got]
    bind("base", topics, wire.middleware, inbox, rate=100.0)
    publish = {}
    for name, side in (("stick", "left"), ("other", "right")):
        out = TopicOut(f"/base/{side}", "geometry_msgs/Twist", Twist, lambda: TWIST)
        publish[name] = bind(name, (out,), wire.node(name), Inbox(), rate=100.0)

    def send(*senders):
        for sender in senders:
            publish[sender].run()
        inbox.apply()
        return len(got["left"]), len(got["right"])

    assert send("stick", "other") == (1, 0)
    assert caplog.messages == ["topic base/right: messages of other are ignored while stick sends"]
    wire.pass_time(0.4)
    assert send("other", "stick") == (2, 0)
    wire.pass_time(SoleSender.TIMEOUT - 0.01)
    assert send("other") == (2, 0)
    wire.pass_time(0.02)
    assert send("other") == (2, 1)
    assert send("stick") == (2, 1)
    assert caplog.messages[-1] == "topic base/left: messages of stick are ignored while other sends"


@pytest.mark.parametrize(("one", "two"), [(1.8e9, 5.0), (3.0, 1e5)])
def test_each_sender_has_a_clock_of_its_own(one, two, caplog):
    """Both send at the same time, and both count; a stamp that goes back does not, unless they stay back for 0.2 s."""
    wire, inbox, got, waiting = MemoryWire(), Inbox(), [], []
    interface = "geometry_msgs/TwistStamped"
    bind(
        "base",
        (TopicIn("twist", interface, TwistStamped, got.append, ordered=True),),
        wire.middleware,
        inbox,
        rate=100.0,
    )
    out = TopicOut("/base/twist", interface, TwistStamped, waiting.pop)
    publish = {name: bind(name, (out,), wire.node(name), Inbox(), rate=100.0) for name in ("stick", "other")}

    def counts(sender, stamp):
        before = len(got)
        waiting.append(TwistStamped(Header(stamp, "world")))
        publish[sender].run()
        inbox.apply()
        wire.pass_time(0.03)
        return len(got) > before

    for tick in range(20):
        assert counts("stick", one + 0.05 * tick) and counts("other", two + 0.05 * tick)
    assert not caplog.messages
    assert not counts("stick", one) and f"of stick is refused: a stamp of {one:.3f} s after" in caplog.text
    assert counts("stick", one + 1.0) and counts("other", 0.0)
    back = [counts("other", two + 0.03 * tick) for tick in range(12)]
    assert back == [False] * 7 + [True] * 5


def test_nothing_is_handed_over_while_refused(wire):
    got, inbox = [], Inbox("it waits")
    bind("base", (TopicIn("twist", "geometry_msgs/Twist", Twist, got.append),), wire.middleware, inbox, rate=100.0)
    topic = TopicOut("/base/twist", "geometry_msgs/Twist", Twist, lambda: TWIST)
    publications = bind("stick", (topic,), wire.node("sender"), Inbox(), rate=100.0)
    publications.run()
    inbox.apply()
    inbox.refusal = ""
    inbox.apply()
    assert not got
    publications.run()
    inbox.apply()
    assert got == [TWIST]


def test_a_handler_that_refuses_is_logged(wire, caplog):
    def refuse(_):
        raise ComponentError("a twist of the wrong kind", expected="another one")

    inbox = Inbox()
    bind("base", (TopicIn("twist", "geometry_msgs/Twist", Twist, refuse),), wire.middleware, inbox, rate=100.0)
    topic = TopicOut("/base/twist", "geometry_msgs/Twist", Twist, lambda: TWIST)
    publications = bind("stick", (topic,), wire.node("sender"), Inbox(), rate=100.0)
    publications.run()
    inbox.apply()
    assert "base/twist" in caplog.text and "of sender" in caplog.text and "wrong kind" in caplog.text


def test_another_class_than_declared_is_refused():
    topic = TopicOut("out", "geometry_msgs/Twist", Twist, lambda: "fast")
    publications = bind("stick", (topic,), MemoryWire().middleware, Inbox(), rate=100.0)
    with pytest.raises(ComponentError, match="a str for topic stick/out"):
        publications.run()


def test_messages_of_pipes_alone_cannot_be_declared():
    topic = TopicIn("base", "sensor_msgs/JointState", Twist, print)
    with pytest.raises(MiddlewareError, match="JointState cannot be declared"):
        bind("stick", (topic,), MemoryWire().middleware, Inbox(), rate=100.0)


def test_a_topic_has_one_interface():
    wire = MemoryWire()
    bind("base", (TopicIn("twist", "geometry_msgs/Twist", Twist, print),), wire.middleware, Inbox(), rate=100.0)
    other = TopicOut("/base/twist", "geometry_msgs/TwistStamped", TwistStamped, print)
    with pytest.raises(MiddlewareError, match="carries geometry_msgs/Twist"):
        bind("stick", (other,), wire.middleware, Inbox(), rate=100.0)


def test_a_name_is_declared_once():
    topics = [TopicIn("twist", "geometry_msgs/Twist", Twist, print)] * 2
    with pytest.raises(ComponentError, match="'base/twist' is declared twice"):
        bind("base", topics, MemoryWire().middleware, Inbox(), rate=100.0)


@pytest.mark.parametrize("rate", [0, 0.0, -5.0, "50", float("nan"), float("inf")])
def test_a_rate_is_positive(rate):
    topic = TopicOut("twist", "geometry_msgs/TwistStamped", TwistStamped, print, rate=rate)
    with pytest.raises(ComponentError, match="'base' declares the topic 'base/twist' with a rate of"):
        bind("base", (topic,), MemoryWire().middleware, Inbox(), rate=100.0)


def test_topics_with_a_rate_share_no_cycle():
    """Of three topics at 50 Hz in a loop of 200 Hz each is published every fourth cycle, one that has none in each."""
    publications = Publications()
    published = []
    for topic, cycles in (("first", 4), ("each", 1), ("second", 4), ("third", 4)):
        publications.add(partial(published.append, topic), cycles)
    for cycle in range(8):
        published.append(cycle)
        publications.left -= 1
        if not publications.left:
            publications.run()
    turn = ["first", "each", "each", "second", "each", "third", "each"]
    assert [each for each in published if isinstance(each, str)] == turn * 2
    assert published[:4] == [0, "first", "each", 1]


def test_what_cannot_be_published_keeps_nothing_from_going_on():
    publications = Publications()
    published = []

    def fail():
        if not published:
            raise ComponentError("no number", expected="a number")

    for publish, cycles in ((fail, 1), (partial(published.append, "slow"), 3)):
        publications.add(publish, cycles)

    def cycle():
        publications.left -= 1
        if not publications.left:
            publications.run()

    with pytest.raises(ComponentError):
        cycle()
    published.append("begun")
    for _ in range(6):
        cycle()
    assert published == ["begun", "slow", "slow"]
