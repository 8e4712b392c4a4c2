"""Topics in shared memory: the newest message, every message, and a way to write.

Who speaks on a topic has a segment there, a pipe with this one writer: nobody can spoil what another one says. As on
every middleware a reader takes the newest message and knows who speaks.
"""

import logging
from collections import deque
from collections.abc import Callable
from typing import Any

from solfer.logs import Throttle
from solfer.middleware.xbot.lane import DEPTH, KIND, PIPES, Lane, Lanes, header, require_message
from solfer.middleware.xbot.layouts import TYPES, Layout, kind_of
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.records import Record
from solfer.middleware.xbot.ring import Ring
from solfer.middleware.xbot.segment import Segment
from solfer.middleware.xbot.slot import Slot
from solfer.pipes.endpoints import NEW, NONE, OLD, Queue, Reader, Status, Writer
from solfer.pipes.messages import Message

logger = logging.getLogger(__name__)


class XbotReader(Reader):
    """The newest message of a topic; `message` is the same object from one read to the next.

    Args:
        namespace: Where the topic is.
        topic: Its name.
        message: Canonical name of its message.
        now: Clock of all processes of the namespace [s].

    Raises:
        MiddlewareError: The topic carries another message.
    """

    def __init__(self, namespace: Namespace, topic: str, message: str, now: Callable[[], float]):
        super().__init__()
        self.topic, self._now = topic, now
        self._lanes = Lanes(namespace, topic, message, Slot)

    @property
    def refused(self) -> int:
        """See `Reader`."""
        return self._lanes.refused

    def read(self) -> Status:
        """See `Reader.read`."""
        lanes, news = self._lanes, None
        if lanes.changed():
            news = self._newest(None)  # a sender that ends, or says something else, may have spoken before
            lanes.update()
        news = self._newest(news)
        if news is None or news.record.sent < self.arrival:  # sent before what is known already
            return NONE if self.message is None else OLD
        self.message, self.arrival = news.record.decode(), news.record.sent
        return NEW

    def age(self) -> float:
        """See `Reader.age`."""
        return self._now() - self.arrival

    def close(self) -> None:
        """Let go of the topic."""
        self._lanes.current = []

    def _newest(self, news: Lane | None) -> Lane | None:
        """The lane with the newest message that was not read yet, `news` if there is no newer one."""
        for lane in self._lanes.current:
            if lane.end.read() is NEW:
                sent = self.senders[lane.sender] = lane.record.sent
                if news is None or sent >= news.record.sent:
                    news = lane
        return news


class XbotQueue(Queue):
    """Every message of a topic, of one sender in its order.

    Args:
        namespace: Where the topic is.
        topic: Its name.
        message: Canonical name of its message.
        size: Messages of one `drain` at most.

    Raises:
        MiddlewareError: The topic carries another message.
    """

    def __init__(self, namespace: Namespace, topic: str, message: str, size: int):
        self.topic = topic
        self._lanes, self._messages = Lanes(namespace, topic, message, Ring), deque(maxlen=size)
        self._lanes.update()
        for lane in self._lanes.current:
            lane.end.skip()

    def drain(self) -> list[Any]:
        """See `Queue.drain`."""
        lanes = self._lanes
        if not (self._messages or lanes.changed()):
            for lane in lanes.current:
                if lane.end.behind():
                    break
            else:
                return []
        self._take()
        if lanes.changed():
            lanes.update()
            self._take()
        messages = list(self._messages)
        self._messages.clear()
        return messages

    def close(self) -> None:
        """Let go of the topic."""
        self._lanes.current = []

    def _take(self) -> None:
        messages = self._messages
        for lane in self._lanes.current:
            lost = lane.end.lost
            while lane.end.read():
                self.dropped += len(messages) == messages.maxlen
                messages.append(lane.record.copy())
            self.dropped += lane.end.lost - lost


class XbotWriter(Writer):
    """A topic to write to. What listeners have not taken is overwritten: nobody waits for them.

    Args:
        namespace: Where the topic is.
        topic: Its name.
        message: Canonical name of its message.
        sender: Who writes.
        now: Clock of all processes of the namespace [s].

    Raises:
        MiddlewareError: Another writer has this name there, or the topic carries another message.
    """

    def __init__(self, namespace: Namespace, topic: str, message: str, sender: str, now: Callable[[], float]):
        self.topic, self._message, self._bell = topic, message, namespace.bell(PIPES, topic)
        self._sender, self._now, self._throttle = sender, now, Throttle(logger)
        require_message(namespace, topic, message)
        path = namespace.place(PIPES, topic, sender)
        self._segment = Segment.create(path, KIND, header(message, sender, None), 0)
        self._layout: Layout | None = None
        self._last: Message | None = None
        self._end: Ring | None = None
        self._record: Record | None = None

    def prepare(self, message: Message) -> None:
        """See `Writer.prepare`."""
        if self._layout is None or not self._layout.fits(message):
            self._lay_out(message)
        self._last = message

    def write(self, message: Message) -> None:
        """See `Writer.write`.

        Other names, frames or sizes than in the message before need a new segment, which takes some 0.3 ms. One object
        that is written again and again keeps its own.

        Raises:
            MiddlewareError: There is no memory for such a segment.
        """
        if message is not self._last:
            self.prepare(message)
        now = self._now()
        self._record.encode(message, now)
        self._end.write(int(1e9 * now))

    def close(self) -> None:
        """Tell listeners that nothing more comes."""
        self._segment.close()
        self._bell.ring()

    def _lay_out(self, message: Message) -> None:
        layout = kind_of(self._message).of(message)
        size = Ring.size(layout.width, DEPTH)
        self._segment = self._segment.recreate(header(self._message, self._sender, layout), size)
        self._end = Ring(self._segment.data, layout.width, DEPTH)
        self._record = layout.bind(TYPES[self._message], self._end.values, self._sender)
        self._layout = layout
        self._bell.ring()
