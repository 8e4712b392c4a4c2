"""Topics that components of a namespace declare, as the bridge finds them."""

from support.unit.declarations import COUNT, CountingNode, Twist
from support.unit.wires import XbotWire

from solfer.components import TopicIn
from solfer.middleware.shared_memory import Namespace
from solfer.middleware.shared_memory.discovery import declared_topics, published_topics
from solfer.segments.segment import Segment
from solfer.transport import Inbox
from solfer.transport.declared.binding import bind
from solfer.transport.declared.goals import GOAL_ID, STATUS
from solfer.transport.topics import Topics


def test_what_is_declared_is_found():
    """The bridge knows a layer's actions and topics by this alone, without pipes, and no longer after a close."""
    wire = XbotWire()
    node, base = wire.node("counter"), wire.node("base")
    CountingNode(node)
    bind("base", (TopicIn("twist", "geometry_msgs/Twist", Twist, print),), base, Inbox(), rate=100.0)
    base.queue("pipe", "nav_msgs/Odometry")
    namespace = Namespace("contract", wire.folder)
    found = {each.topic: each.message for each in declared_topics(namespace, ("known",))}
    assert found == {
        "abacus/count/goal": f"{COUNT}ActionGoal",
        "abacus/count/cancel": GOAL_ID,
        "base/twist": "geometry_msgs/Twist",
    }
    published = {each.topic: each.message for each in published_topics(namespace)}
    assert published["abacus/count/status"] == STATUS and published["abacus/count/result"] == f"{COUNT}ActionResult"
    base.close()
    assert "base/twist" not in {each.topic for each in declared_topics(namespace)}
    wire.close()


def test_segments_are_opened_only_after_a_notification(monkeypatch):
    """Looking for topics is cheap while nothing changes: the attached segments are counted."""
    wire = XbotWire()
    node, other = wire.node("arm"), wire.node("base")
    other.writer("odometry", "nav_msgs/Odometry")
    node.writer("desired", "nav_msgs/Odometry")
    opened, attach = [], Segment.attach
    monkeypatch.setattr(Segment, "attach", lambda path, kind: opened.append(path.name) or attach(path, kind))
    assert node.topics().result() == Topics({"odometry": "nav_msgs/Odometry"}, {})
    assert opened
    opened.clear()
    assert node.topics().result() == Topics({"odometry": "nav_msgs/Odometry"}, {}) and not opened
    queue = other.queue("desired", "nav_msgs/Odometry")
    assert node.topics().result().received == {"desired": "nav_msgs/Odometry"} and opened
    queue.close()
    other.close()
    assert node.topics().result() == Topics({}, {})
    wire.close()


def test_a_killed_publisher_is_seen_without_a_notification(monkeypatch):
    wire = XbotWire()
    node, other = wire.node("arm"), wire.node("base")
    other.writer("odometry", "nav_msgs/Odometry")
    assert node.topics().result().published
    monkeypatch.setattr(Segment, "owned", lambda _: False)  # as after `kill -9`, which rings nothing
    assert not node.topics().result().published
    wire.close()
