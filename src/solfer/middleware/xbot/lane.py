"""The segment in which one sender speaks on a topic, and the search for those of all senders."""

import json
import logging
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.logs import Throttle
from solfer.middleware.xbot.layouts import TYPES, Layout, kind_of
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.records import Record
from solfer.middleware.xbot.ring import Ring
from solfer.middleware.xbot.segment import Segment
from solfer.middleware.xbot.slot import Slot

logger = logging.getLogger(__name__)

KIND, PIPES = "pipe", "pipes"
DEPTH = 64
"""Messages that a sender keeps for those who want every one."""


def header(message: str, sender: str, layout: Layout | None) -> bytes:
    """Text in the header of a pipe's segment; without a `layout` nothing was said yet."""
    content = None if layout is None else layout.header()
    return json.dumps({"message": message, "sender": sender, "content": content}).encode()


class Lane:
    """What one sender says on a topic, as a listener has it.

    Args:
        segment: The sender's segment, in which something can be said.
        end: `Slot` for the newest message, `Ring` for every one.
        message: Canonical name of the message.

    Attributes:
        end: The end.
        record: What was read last.
        sender: Who speaks.
    """

    def __init__(self, segment: Segment, end: type[Slot] | type[Ring], message: str):
        told = json.loads(segment.layout)
        layout = kind_of(message).read(told["content"])
        self.segment, self.sender = segment, told["sender"]
        self.end = end(segment.data, layout.width, DEPTH)
        self.record: Record = layout.bind(TYPES[message], self.end.values, self.sender)


class Lanes:
    """The lanes of a topic, kept up to date: senders come, end, come again, and say something else.

    Args:
        namespace: Where they are.
        topic: Name of the topic.
        message: Canonical name of the message that is expected.
        end: `Slot` for the newest messages, `Ring` for every one.

    Attributes:
        changed: Whether `update` has something to do.
        current: The lanes, in the order of their names.
        refused: Segments that are damaged, or carry something else.

    Raises:
        MiddlewareError: Somebody speaks already, and it is another message.
    """

    def __init__(self, namespace: Namespace, topic: str, message: str, end: type[Slot] | type[Ring]):
        self._namespace, self._topic, self._message, self._end = namespace, topic, message, end
        self.current: list[Lane] = []
        self.refused, self._throttle, self._bell = 0, Throttle(logger), namespace.bell(PIPES, topic)
        self.changed = self._bell.rung
        require_message(namespace, topic, message)

    def update(self) -> None:
        """Look for lanes that are new, and let go of those that have ended."""
        self._bell.hear()
        known = {lane.segment.path: lane for lane in self.current if not lane.segment.retired}
        current = []
        for name in self._namespace.present(PIPES, self._topic):
            path = self._namespace.path(PIPES, self._topic, name)
            lane = known.get(path) or self._open(path)
            if lane is not None:
                current.append(lane)
        self.current = current

    def _open(self, path: Path) -> Lane | None:
        """The lane of a segment; None if nothing was said yet, its sender is dead, or it is refused."""
        try:
            segment = Segment.attach(path, KIND)
            told = json.loads(segment.layout)
            if told["message"] != self._message:
                raise MiddlewareError(f"'{told['sender']}' sends {told['message']}", where=str(path),
                                      expected=self._message)
            if told["content"] is None or not segment.owned():
                return None
            return Lane(segment, self._end, self._message)
        except MiddlewareError as error:
            if path.exists():
                self.refused += 1
                self._throttle.warning(str(path), "topic %s: %s", self._topic, error)
            return None


def require_message(namespace: Namespace, topic: str, message: str) -> None:
    """Check that nobody who lives sends another message on a topic.

    Raises:
        MiddlewareError: Somebody does, or there is no such message.
    """
    kind_of(message)
    for name in namespace.present(PIPES, topic):
        path = namespace.path(PIPES, topic, name)
        try:
            segment = Segment.attach(path, KIND)
        except MiddlewareError:
            continue  # who reads tells of what is damaged, who writes makes it anew
        told = json.loads(segment.layout)
        if told["message"] != message and segment.owned():
            raise MiddlewareError(f"topic '{topic}' carries {told['message']} of '{told['sender']}'", where=str(path),
                                  expected=message)
