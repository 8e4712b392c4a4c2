"""What is published and offered in a namespace at present, for nodes that have no configuration."""

import dataclasses
import json
from collections.abc import Container
from dataclasses import dataclass
from typing import Any, TypeAlias

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.rpc.services import SERVICES, offered
from solfer.middleware.shared_memory.topics import subscriptions
from solfer.middleware.shared_memory.topics.sender_segment import PIPES, SENDER_KIND, sender_of
from solfer.segments.namespace import Namespace
from solfer.segments.segment import Segment
from solfer.transport.topics import Topics

Opened: TypeAlias = dict[str, dict[str, Segment]]
"""Segments by their names, for each topic."""


@dataclass(frozen=True)
class PublishedTopic:
    """A topic with a publisher.

    Attributes:
        topic: Its name.
        message: Canonical name of its message.
    """

    topic: str
    message: str


@dataclass(frozen=True)
class AvailableService:
    """A service that a living process offers.

    Attributes:
        name: Its full name.
        interface: `package/Type`.
        request: Dataclass with the fields of the request.
        reply: Dataclass with the fields of the reply.
    """

    name: str
    interface: str
    request: type
    reply: type


def published_topics(namespace: Namespace, known: Container[str] = ()) -> list[PublishedTopic]:
    """List the topics with a living publisher; commands to controllers of the lower level are left out.

    Args:
        namespace: Where.
        known: Topics to leave out.
    """
    found = {}
    for topic in namespace.present(PIPES):
        if topic.endswith("/command") or topic in known:
            continue
        for content in _contents(namespace, PIPES, SENDER_KIND, topic=topic).values():
            found[topic] = PublishedTopic(topic, content["message"])
    return list(found.values())


def declared_topics(namespace: Namespace, known: Container[str] = ()) -> list[PublishedTopic]:
    """List the topics that a component of the namespace receives and declares; see `published_topics`."""
    found = {}
    for topic in namespace.present(subscriptions.FOLDER):
        if topic in known:
            continue
        for content in _contents(namespace, subscriptions.FOLDER, subscriptions.KIND, topic=topic).values():
            if content.get("declared"):
                found[topic] = PublishedTopic(topic, content["message"])
    return list(found.values())


class Survey:
    """The topics of a namespace, whose segments are opened again only when one was made or has ended.

    To open them takes as long as some cycles of a 1 kHz loop, and who looks for missing peers looks again and again.

    Args:
        namespace: Where.
    """

    def __init__(self, namespace: Namespace):
        self._namespace = namespace
        self._notification = namespace.any_notification()
        self._published: Opened = {}
        self._received: Opened = {}

    def topics_beside(self, node: str) -> Topics:
        """Find the topics, commands included, that other nodes than the one of that name publish and receive."""
        if self._notification.is_pending():
            self._notification.acknowledge()
            self._published = self._open(PIPES, SENDER_KIND)
            self._received = self._open(subscriptions.FOLDER, subscriptions.KIND)
        return Topics(*(_beside(node, opened) for opened in (self._published, self._received)))

    def _open(self, folder: str, kind: str) -> Opened:
        namespace = self._namespace
        return {topic: _opened(namespace, folder, kind, topic=topic) for topic in namespace.present(folder)}


def services(namespace: Namespace, known: Container[str] = ()) -> list[AvailableService]:
    """List the services that a living process offers.

    Args:
        namespace: Where.
        known: Services to leave out.
    """
    found = []
    for name in namespace.present(SERVICES):
        segment = None if name in known else offered(namespace, name)
        if segment is not None:
            interface, request, reply = json.loads(segment.layout)
            found.append(
                AvailableService(name, interface, _dataclass("Request", request), reply=_dataclass("Reply", reply))
            )
    return found


def _contents(namespace: Namespace, folder: str, kind: str, topic: str) -> dict[str, dict[str, Any]]:
    """Read the content of each segment of a topic with a living owner, by its name."""
    return {name: json.loads(segment.layout) for name, segment in _opened(namespace, folder, kind, topic=topic).items()}


def _beside(node: str, opened: Opened) -> dict[str, str]:
    """Return the message of each topic with a living segment of another node than the one of that name."""
    found = {}
    for topic, segments in opened.items():
        for name, segment in segments.items():
            if sender_of(name) != node and segment.owned():
                found[topic] = json.loads(segment.layout)["message"]
    return found


def _opened(namespace: Namespace, folder: str, kind: str, topic: str) -> dict[str, Segment]:
    """Open the segments of a topic with a living owner, by their names."""
    found = {}
    for name in namespace.present(folder, topic):
        try:
            segment = Segment.attach(namespace.path(folder, topic, name), kind)
        except MiddlewareError:
            continue  # it ends at this moment, or it is damaged, which its readers report
        if segment.owned():
            found[name] = segment
    return found


def _dataclass(name: str, fields: list[str]) -> type:
    """Make a dataclass with the fields that a service's segment lists."""
    return dataclasses.make_dataclass(name, fields, frozen=True)
