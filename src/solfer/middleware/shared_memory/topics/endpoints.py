"""Topics in shared memory: the newest message, every message, and their writers.

Each publisher of a topic has a segment there, a pipe with this one writer, so that no publisher can spoil the messages
of another one. As on every middleware a reader gets the newest message and knows the publishers.
"""

import logging
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from solfer.middleware.shared_memory.topics.layouts import Layout, kind_of
from solfer.middleware.shared_memory.topics.sender_segment import (
    PIPES,
    SENDER_DEPTH,
    SENDER_KIND,
    SenderSegment,
    SenderSegments,
    file_of,
    header,
    require_message,
)
from solfer.middleware.shared_memory.topics.wire_records import SENT_COLUMN, STAMP_COLUMN, WireRecord
from solfer.segments.namespace import Namespace, Notification
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.segments.slot import NEWEST, Slot
from solfer.throttle import Throttle
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus, Queue, Reader, Writer
from solfer.transport.messages import Message, type_of

logger = logging.getLogger(__name__)


class XbotReader(Reader):
    """The newest message of a topic, or each of them; `message` is the same object from one read to the next.

    Args:
        namespace: Where the topic is.
        topic: Its name.
        message: Canonical name of its message.
        now: Clock of all processes of the namespace [s].
        kept: See `Middleware.reader`.

    Raises:
        MiddlewareError: The topic carries another message.
    """

    def __init__(self, namespace: Namespace, topic: str, message: str, now: Callable[[], float], kept: int = 0):
        self.topic = topic
        self.carries = message
        self._now = now
        self._kept = kept
        self._sender_segments = SenderSegments(namespace, topic, message, end=Ring if kept else Slot)
        self._notification = self._sender_segments.notification
        self.publishers: list[SenderSegment] = []
        self._sources: list[SenderSegment] = []  # with those that have ended, until all of theirs is read
        if kept:
            self._sources = list(self.update())
            for source in self._sources:
                source.end.limit(1)
                source.end.lost = 0

    @property
    def refused(self) -> int:
        """See `Reader`."""
        return self._sender_segments.refused

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        news = None
        notification = self._notification
        quiet = notification.words[notification.place] == notification.received
        for sender_segment in self.publishers if quiet else self.update():
            slot = sender_segment.end
            number = slot.words[NEWEST]
            if number != slot.sequence and (slot.fetch(number) or slot.read()):
                sent = sender_segment.arrival = sender_segment.record.front[SENT_COLUMN]
                if news is None or sent >= news.arrival:
                    news = sender_segment
        if news is None or news.arrival < self.arrival:  # sent before what is known already
            return NONE if self.message is None else OLD
        record = news.record
        record.attributes["stamp"] = record.front[STAMP_COLUMN]
        if record.changes:
            record.update()
        self.message = record.message
        self.arrival = news.arrival
        return NEW

    def update(self) -> Sequence[SenderSegment]:
        """See `Reader.update`."""
        sender_segments = self._sender_segments
        if self._notification.words[self._notification.place] == self._notification.received:
            return sender_segments.current
        before = sender_segments.current
        sender_segments.update()
        self.publishers = sender_segments.current
        # a sender that ends, or changes its layout, may have published before
        return [
            *(sender_segment for sender_segment in before if sender_segment not in sender_segments.current),
            *sender_segments.current,
        ]

    def read_from(self, publisher: SenderSegment) -> MessageStatus:
        """See `Reader.read_from`."""
        slot = publisher.end
        number = slot.words[NEWEST]
        if number == slot.sequence or not (slot.fetch(number) or slot.read()):
            return NONE if self.message is None else OLD
        record = publisher.record
        record.attributes["stamp"] = record.front[STAMP_COLUMN]
        if record.changes:
            record.update()
        self.message = record.message
        self.arrival = publisher.arrival = record.front[SENT_COLUMN]
        return NEW

    def read_next(self) -> SenderSegment | None:
        """See `Reader.read_next`."""
        if self._notification.words[self._notification.place] != self._notification.received:
            current = self.update()
            self._sources = [*(source for source in self._sources if source not in current), *current]
        oldest = None
        arrival = 0.0
        for source in self._sources:
            if not source.ahead and source.end.words[NEWEST] != source.end.sequence:
                ring: Any = source.end  # one that keeps messages
                number = ring.sequence + 1
                if ring.words[NEWEST] - number < self._kept and ring.fetch(number):
                    source.ahead = True
                else:
                    lost = ring.lost
                    source.ahead = ring.read(self._kept)
                    self.dropped += ring.lost - lost
            if source.ahead:
                sent = source.record.front[SENT_COLUMN]
                if oldest is None or sent < arrival:
                    oldest = source
                    arrival = sent
        if oldest is None:
            self._sources = self.publishers
            return None
        oldest.ahead = False
        self.has_next = len(self._sources) > 1 or oldest.end.words[NEWEST] != oldest.end.sequence
        record = oldest.record
        record.attributes["stamp"] = record.front[STAMP_COLUMN]
        if record.changes:
            record.update()
        self.message = record.message
        self.arrival = oldest.arrival = arrival
        return oldest

    def age(self) -> float:
        """See `Reader.age`."""
        return self._now() - self.arrival

    def close(self) -> None:
        """Close the segments of the topic."""
        self.publishers = self._sender_segments.current = []


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
        self._sender_segments = SenderSegments(namespace, topic, message, end=Ring)
        self._notification = self._sender_segments.notification
        self._messages: deque[Any] = deque(maxlen=size)
        self.waits = self  # see `Queue.waits`
        self._sender_segments.update()
        for sender_segment in self._sender_segments.current:
            sender_segment.end.skip()

    @property
    def ends(self) -> "list[Slot | Ring]":
        """The ends from which the messages come, until the notification of the topic is sent."""
        return [sender_segment.end for sender_segment in self._sender_segments.current]

    def __bool__(self) -> bool:
        notification = self._notification
        if self._messages or notification.words[notification.place] != notification.received:
            return True
        for sender_segment in self._sender_segments.current:
            if sender_segment.end.words[NEWEST] != sender_segment.end.sequence:
                return True
        return False

    def drain(self) -> list[Any]:
        """See `Queue.drain`."""
        if not self:
            return []
        sender_segments = self._sender_segments
        self._collect()
        if sender_segments.changed():
            self._collect()  # what a sender has sent before it left its segment for another one
            sender_segments.update()
            self._collect()
        messages = list(self._messages)
        self._messages.clear()
        return messages

    def close(self) -> None:
        """Close the segments of the topic."""
        self._sender_segments.current = []

    def _collect(self) -> None:
        messages = self._messages
        for sender_segment in self._sender_segments.current:
            lost = sender_segment.end.lost
            while sender_segment.end.read():
                self.dropped += len(messages) == messages.maxlen
                messages.append(sender_segment.record.copy())
            self.dropped += sender_segment.end.lost - lost


class PendingMessages:
    """Reports whether messages may wait in any of several queues, in one call.

    Args:
        queues: The queues.
        notification: Sent with each notification of their namespace.
    """

    def __init__(self, queues: Sequence[XbotQueue], notification: Notification):
        self._queues = tuple(queues)
        self._words = notification.words
        self._place = notification.place
        self._count = -1
        self._ends = tuple[Slot | Ring, ...]()

    def __call__(self) -> bool:
        """Return it; true as well if a sender of any topic has started or ended."""
        for end in self._ends:
            if end.words[NEWEST] != end.sequence:
                return True
        number = self._words[self._place]
        if number == self._count:
            return False
        for queue in self._queues:
            if queue:
                return True
        # nothing was sent for these queues since they were emptied
        self._count = number
        self._ends = tuple(end for queue in self._queues for end in queue.ends)
        return False


class XbotWriter(Writer):
    """A topic to write to. Messages that no reader has read are overwritten: the writer never waits for readers.

    Args:
        namespace: Where the topic is.
        topic: Its name.
        message: Canonical name of its message.
        sender: Name of the node that writes.
        now: Clock of all processes of the namespace [s].
        number: How many writers the node has there already.

    Raises:
        MiddlewareError: Another writer has this name there, or the topic carries another message.
    """

    def __init__(
        self, namespace: Namespace, topic: str, message: str, sender: str, now: Callable[[], float], *, number: int = 0
    ):
        self.topic = topic
        self._message = message
        self._notification = namespace.notification(PIPES, topic)
        self.carries = message
        self._sender = sender
        self._now = now
        self._throttle = Throttle(logger)
        require_message(namespace, topic, message)
        path = namespace.place(PIPES, topic, file_of(sender, number))
        self._segment = Segment.create(path, SENDER_KIND, header(message, sender, None), size=0)
        self._layout: Layout | None = None
        self._last: Message | None = None
        self._end: Ring | None = None
        self._record: WireRecord | None = None

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
        record = self._record
        block = record.block
        if block is not None and message.block is not None and message.rows == record.rows:
            block[...] = message.block
        elif record.views:
            for name, view in record.views:
                view[...] = getattr(message, name)
        elif not record.encode(message):  # no room: only writing it out shows how long a text is
            self._lay_out(message)
            record = self._record
            record.encode(message)
        now = self._now()
        front = record.front
        front[SENT_COLUMN] = now
        front[STAMP_COLUMN] = message.stamp
        self._end.put(int(1e9 * now))

    def close(self) -> None:
        """Retire the segment, so that readers know that nothing more comes."""
        self._segment.close()
        self._notification.send()

    def _lay_out(self, message: Message) -> None:
        layout = kind_of(self._message).from_message(message)
        size = Ring.size(layout.width, SENDER_DEPTH)
        self._segment = self._segment.recreate(header(self._message, self._sender, layout), size)
        self._end = Ring(self._segment.data, layout.width, SENDER_DEPTH)
        self._record = layout.bind(type_of(self._message), self._end.values, self._sender)
        self._layout = layout
        self._notification.send()
