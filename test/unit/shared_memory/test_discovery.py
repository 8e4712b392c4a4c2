"""Topics that components of a namespace declare, as the bridge finds them."""

from support.unit.declarations import COUNT, CountingNode, Twist
from support.unit.wires import XbotWire

from solfer.components import TopicIn
from solfer.middleware.shared_memory import Namespace
from solfer.middleware.shared_memory.discovery import declared_topics, published_topics
from solfer.transport import Inbox
from solfer.transport.declared.binding import bind
from solfer.transport.declared.goals import GOAL_ID, STATUS


def test_what_is_declared_is_found():
    wire = XbotWire()
    node, base = wire.node("counter"), wire.node("base")
    CountingNode(node)
    bind("base", (TopicIn("wanted", "geometry_msgs/Twist", Twist, print),), base, Inbox())
    base.queue("pipe", "nav_msgs/Odometry")
    namespace = Namespace("contract", wire.folder)
    found = {each.topic: each.message for each in declared_topics(namespace, ("known",))}
    assert found == {
        "abacus/count/goal": f"{COUNT}ActionGoal",
        "abacus/count/cancel": GOAL_ID,
        "base/wanted": "geometry_msgs/Twist",
    }
    published = {each.topic: each.message for each in published_topics(namespace)}
    assert published["abacus/count/status"] == STATUS and published["abacus/count/result"] == f"{COUNT}ActionResult"
    base.close()
    assert "base/wanted" not in {each.topic for each in declared_topics(namespace)}
    wire.close()
