"""The segment in which one sender publishes on a topic, and the search for those of all senders."""

import json
import logging
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.topics.layouts import Layout, kind_of
from solfer.middleware.shared_memory.topics.wire_records import WireRecord
from solfer.segments.namespace import Namespace
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.segments.slot import Slot
from solfer.throttle import Throttle
from solfer.transport.endpoints import Publisher
from solfer.transport.messages import type_of

logger = logging.getLogger(__name__)

SENDER_KIND = "pipe"
PIPES = "pipes"
SENDER_DEPTH = 64
"""Messages that a sender keeps for readers of every one."""


SEPARATOR = "#"
"""In the file's name of a segment, between its node and the number of a further writer of that node."""


def file_of(sender: str, number: int) -> str:
    """Return the name of the file of a node's writer: it may have several on a topic, counted from 0."""
    return f"{sender}{SEPARATOR}{number}" if number else sender


def sender_of(file: str) -> str:
    """Return the node that a segment's file belongs to; see `file_of`."""
    return file.partition(SEPARATOR)[0]


def header(message: str, sender: str, layout: Layout | None) -> bytes:
    """Encode the header of a pipe's segment; without a `layout` nothing was published yet."""
    content = None if layout is None else layout.header()
    return json.dumps({"message": message, "sender": sender, "content": content}).encode()


class SenderSegment(Publisher):
    """The messages of one sender on a topic, as a reader sees them.

    Args:
        segment: The sender's segment, with a layout.
        end: `Slot` for the newest message, `Ring` for every one.
        message: Canonical name of the message.

    Attributes:
        end: The end.
        record: What was read last.
        ahead: Whether that waits for its turn, because another sender has published something earlier.
    """

    def __init__(self, segment: Segment, end: type[Slot] | type[Ring], message: str):
        published = json.loads(segment.layout)
        layout = kind_of(message).read(published["content"])
        super().__init__(published["sender"])
        self.segment = segment
        self.ahead = False
        self.end = end(segment.data, layout.width, SENDER_DEPTH)
        self.record: WireRecord = layout.bind(type_of(message), self.end.values, self.name)


class SenderSegments:
    """The segments of a topic, kept up to date: senders start, end, start again, and change their layout.

    Args:
        namespace: Where they are.
        topic: Name of the topic.
        message: Canonical name of the message that is expected.
        end: `Slot` for the newest messages, `Ring` for every one.

    Attributes:
        changed: Whether `update` has something to do.
        notification: Sent when it has.
        current: The segments, in the order of their names.
        refused: Number of segments that are damaged, or carry another message.

    Raises:
        MiddlewareError: There is a sender of another message already.
    """

    def __init__(self, namespace: Namespace, topic: str, message: str, end: type[Slot] | type[Ring]):
        self._namespace = namespace
        self._topic = topic
        self._message = message
        self._end = end
        self.current: list[SenderSegment] = []
        self.refused = 0
        self._throttle = Throttle(logger)
        self.notification = namespace.notification(PIPES, topic)
        self.changed = self.notification.is_pending
        require_message(namespace, topic, message)

    def update(self) -> None:
        """Open segments that are new, and drop those that have ended."""
        self.notification.acknowledge()
        known = {
            sender_segment.segment.path: sender_segment
            for sender_segment in self.current
            if not sender_segment.segment.retired
        }
        current = []
        for name in self._namespace.present(PIPES, self._topic):
            path = self._namespace.path(PIPES, self._topic, name)
            sender_segment = known.get(path) or self._open(path)
            if sender_segment is not None:
                current.append(sender_segment)
        self.current = current

    def _open(self, path: Path) -> SenderSegment | None:
        """Open a segment; None if nothing was published yet, its sender is dead, or it is refused."""
        try:
            segment = Segment.attach(path, SENDER_KIND)
            published = json.loads(segment.layout)
            if published["message"] != self._message:
                raise MiddlewareError(
                    f"'{published['sender']}' sends {published['message']}", where=str(path), expected=self._message
                )
            if published["content"] is None or not segment.owned():
                return None
            return SenderSegment(segment, self._end, self._message)
        except MiddlewareError as error:
            if path.exists():
                self.refused += 1
                self._throttle.warning(str(path), "topic %s: %s", self._topic, error)
            return None


def require_message(namespace: Namespace, topic: str, message: str) -> None:
    """Check that no living process sends another message on a topic.

    Raises:
        MiddlewareError: One does, or there is no such message.
    """
    kind_of(message)
    for name in namespace.present(PIPES, topic):
        path = namespace.path(PIPES, topic, name)
        try:
            segment = Segment.attach(path, SENDER_KIND)
        except MiddlewareError:
            continue  # readers report what is damaged, its writer makes it again
        published = json.loads(segment.layout)
        if published["message"] != message and segment.owned():
            raise MiddlewareError(
                f"topic '{topic}' carries {published['message']} of '{published['sender']}'",
                where=str(path),
                expected=message,
            )
