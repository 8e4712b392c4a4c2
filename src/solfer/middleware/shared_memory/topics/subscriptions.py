"""Registers the topics to which a node subscribes; reading itself leaves no trace in shared memory."""

import json

from solfer.errors import MiddlewareError
from solfer.segments.namespace import Namespace
from solfer.segments.segment import Segment

KIND = "ear"
FOLDER = "ears"


class Subscriptions:
    """The topics to which a node subscribes: an empty segment for each, which lives as long as the node.

    Args:
        namespace: Where.
        name: Name of the node.
    """

    def __init__(self, namespace: Namespace, name: str):
        self._namespace = namespace
        self._name = name
        self._segments: dict[str, Segment | None] = {}

    def add(self, topic: str, message: str, declared: bool = False) -> None:
        """Register this node as a subscriber of a message; no effect if one of its name is.

        Args:
            topic: Name of the topic.
            message: Canonical name of its messages.
            declared: Whether a component declares the topic: other layers may publish there, too.
        """
        if topic in self._segments:
            return
        try:
            path = self._namespace.place(FOLDER, topic, self._name)
            content = json.dumps({"message": message, "declared": declared}).encode()
            self._segments[topic] = Segment.create(path, KIND, content, size=0)
            self._namespace.notification(FOLDER, topic).send()
        except MiddlewareError:
            self._segments[topic] = None

    def close(self) -> None:
        """Unregister from all topics."""
        for topic, segment in self._segments.items():
            if segment is not None:
                segment.close()
                self._namespace.notification(FOLDER, topic).send()
        self._segments.clear()
