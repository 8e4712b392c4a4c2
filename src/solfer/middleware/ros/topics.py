"""The topics of ROS and the nodes on them, as the master and the nodes report them."""

from collections.abc import Mapping, Sequence

from solfer.middleware.ros.endpoints import RosQueue, RosReader, RosWriter
from solfer.middleware.ros.node.master import graph, subscribed_type
from solfer.transport.topics import Topics


def topics_beside(node: str, endpoints: Sequence[RosReader | RosQueue | RosWriter]) -> Topics:
    """Find the topics that other nodes than `node` publish and receive; `endpoints` are its own.

    The master knows only the types of publishers. A subscriber of this node that did not connect is requested its type.

    Raises:
        MiddlewareError: The master does not answer.
    """
    present = graph()
    published = {topic: present.types.get(topic, "") for topic in _beside(node, present.publishers)}
    listeners = _beside(node, present.subscribers)
    received = {topic: present.types.get(topic, "") for topic in listeners}
    for end in endpoints:
        if isinstance(end, RosWriter) and end.topic in received and not end.topic_publisher.receivers():
            offered = [message for each in listeners[end.topic] if (message := subscribed_type(each, end.topic))]
            if not offered:  # they have ended without unregistering
                del received[end.topic]
            elif end.carries not in offered:
                received[end.topic] = offered[0]
    return Topics(published, received)


def _beside(node: str, nodes: Mapping[str, list[str]]) -> dict[str, list[str]]:
    """Select the topics with nodes other than `node`, and these."""
    others = {topic: [each for each in names if each != node] for topic, names in nodes.items()}
    return {topic: names for topic, names in others.items() if names}
