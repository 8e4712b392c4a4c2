"""Topics: the newest message, every message, and their writers.

rospy's receiving threads only store bytes; what is read is decoded in the thread that reads. Nagle's algorithm is off
on both ends: with it, messages of the size of a joint state arrive in pairs and up to 40 ms late.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Container, Sequence
from functools import partial
from typing import Any, NamedTuple

import genpy
import rospy
from rospy.impl.tcpros_base import TCPROSTransport

from solfer.errors import MiddlewareError, PipeError
from solfer.middleware.ros.codecs.bounded import bound_messages
from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH
from solfer.middleware.ros.codecs.table import Codec, codec
from solfer.middleware.ros.node.expected_publishers import ExpectedPublishers
from solfer.middleware.ros.topic_publisher import TopicPublisher
from solfer.throttle import Throttle
from solfer.transport import MessageStatus, Queue, Reader, Writer
from solfer.transport.backlog import SENDERS, Backlog
from solfer.transport.endpoints import NEW, NONE, OLD, PUBLISHER_TIMEOUT, Publisher
from solfer.transport.messages import Message

logger = logging.getLogger(__name__)

LOCKSTEP_TIMEOUT = 5.0
"""Longest time that an answer, a message or a connection takes in lock-step [s]."""


class Arrival(NamedTuple):
    """A message as it came in, and when by the reader's clock [s]."""

    packed: bytes
    sender: str
    time: float


class Subscription:
    """Hands every message of a topic to `store`, and decodes what it stored.

    Args:
        topic: Name of the topic.
        message: Canonical name of the message.
        size: Messages that may wait between two runs of rospy's receiving thread.
        store: Called in rospy's thread.
        now: Clock of the reader [s].
        largest: Bytes of a message; a larger one is dropped undecoded. None: any size.

    Attributes:
        topic: Resolved name.
        codec: Decodes what is stored.
        oversized: Messages that were too large.

    Raises:
        MiddlewareError: The topic is used in this process with another message.
    """

    def __init__(
        self,
        topic: str,
        message: str,
        size: int,
        store,
        now: Callable[[], float] = time.monotonic,
        *,
        largest: int | None = None,
    ):
        self.codec: Codec = codec(message)
        self._store = store
        self._now = now
        self._throttle = Throttle(logger)
        self._largest = largest
        self.oversized = 0
        self._newest: dict[str, bytes] = {}
        self._has_numbers: bool = self.codec.ros_class._has_header
        self._counts: dict[str, tuple[object, int]] = {}
        try:
            self._subscriber = rospy.Subscriber(
                topic, self.codec.ros_class, self._receive, queue_size=size, tcp_nodelay=True
            )
        except rospy.ROSException as error:
            raise MiddlewareError(
                f"topic '{topic}' cannot be read as {message}: {error}", expected="the name of a topic of this message"
            ) from error
        self.topic = self._subscriber.resolved_name
        if largest is not None:
            self._bound(self._subscriber.impl, largest)

    def _bound(self, implementation: Any, largest: int) -> None:
        """Bound the messages of all connections, later ones included."""
        add = implementation.add_connection

        def add_bounded(connection: TCPROSTransport) -> bool:
            bound_messages(connection.protocol, largest, lambda size: self._refuse(connection.callerid_pub, size))
            return add(connection)

        implementation.add_connection = add_bounded
        for connection in implementation.connections:
            bound_messages(connection.protocol, largest, partial(self._refuse, connection.callerid_pub))

    def _refuse(self, sender: str, size: int) -> None:
        self.oversized += 1
        self._throttle.warning(
            sender,
            "topic %s: a message of %s with %d bytes is dropped: %d bytes at most",
            self.topic,
            sender,
            size,
            self._largest,
        )

    def _receive(self, message: genpy.Message) -> None:
        sender = message._connection_header["callerid"]
        if self._largest is not None and len(message.packed) > self._largest:
            self._refuse(sender, len(message.packed))
            return
        self._store(Arrival(message.packed, sender, self._now()))
        if not self._has_numbers:
            connection, count = self._counts.get(sender, (None, 0))
            same = connection is message._connection_header
            self._counts[sender] = message._connection_header, count + 1 if same else 1
        if sender not in self._newest and len(self._newest) >= SENDERS:
            first = next(iter(self._newest))
            del self._newest[first]
            self._counts.pop(first, None)
        self._newest[sender] = message.packed

    def number(self, sender: str, before: int = 0) -> int:
        """Return the number of a sender's newest message, zero before the first.

        Those without a header are counted, from the number `before` on that was sent before the sender was connected.
        """
        if not self._has_numbers:
            return before + self._counts.get(sender, (None, 0))[1]
        packed = self._newest.get(sender)
        return 0 if packed is None else MESSAGE_LENGTH.unpack_from(packed)[0]

    def senders(self) -> set[str]:
        """Return the names of the nodes that are connected."""
        return {connection.callerid_pub for connection in self._subscriber.impl.connections}

    def decode(self, arrival: Arrival) -> Message | None:
        """Decode a message; None if it is refused."""
        try:
            return self.codec.decode(arrival.packed, arrival.sender)
        except PipeError as error:
            self.refuse(arrival.sender, error)
            return None

    def refuse(self, sender: str, error: PipeError) -> None:
        """Log once a second for each sender that its message cannot be decoded."""
        self._throttle.warning(sender, "topic %s: a message of %s is refused: %s", self.topic, sender, error)

    def close(self) -> None:
        """Unregister."""
        self._subscriber.unregister()


class RosPublisher(Publisher):
    """A node that publishes on a topic, as one reader knows it.

    Attributes:
        newest: Its newest message, None before the first.
        taken: The one that was read last.
    """

    def __init__(self, name: str):
        super().__init__(name)
        self.newest: Arrival | None = None
        self.taken: Arrival | None = None


class RosReader(Reader):
    """The newest message of a topic, or each of them.

    Args:
        topic: Name of the topic.
        message: Canonical name of its message.
        now: Clock in which its age counts [s].
        kept: See `Middleware.reader`.
        in_lockstep: Whether all that is read depends on simulated time only, however long the master takes to answer.

    Attributes:
        subscription: Where the messages come from.
    """

    def __init__(
        self,
        topic: str,
        message: str,
        now: Callable[[], float] = time.monotonic,
        kept: int = 0,
        in_lockstep: bool = False,
    ):
        self._all = RosPublisher("")
        self._now = now
        self._lock = threading.Lock()
        self._by_name: dict[str, RosPublisher] = {}
        # messages without a header have no number, and are counted: none may be left out
        size = 1 if codec(message).ros_class._has_header and not kept else max(kept, 256)
        self._backlog: Backlog[tuple[Arrival, RosPublisher]] | None = Backlog(kept) if kept else None
        self._waiting = deque[tuple[Arrival, RosPublisher]]()
        self.subscription = Subscription(topic, message, size, store=self._store, now=now)
        self._decode = self.subscription.codec.decode
        self.topic = self.subscription.topic
        self.carries = self.subscription.codec.ros_class._type
        self._expected = ExpectedPublishers(
            self.topic,
            self.subscription.senders,
            now=now if in_lockstep else time.monotonic,
            timeout=LOCKSTEP_TIMEOUT if in_lockstep else 0.1,  # a cycle of real time cannot wait longer
        )

    def _store(self, arrival: Arrival) -> None:
        publisher = self._by_name.get(arrival.sender) or self._add(arrival.sender)
        self._all.newest = publisher.newest = arrival
        publisher.arrival = arrival.time
        if self._backlog is not None:
            self._backlog.put(arrival.sender, (arrival, publisher))

    @property
    def dropped(self) -> int:  # type: ignore[override]
        """See `Reader`."""
        return 0 if self._backlog is None else self._backlog.dropped

    def _add(self, name: str) -> RosPublisher:
        """Add a node that publishes for the first time; those that have not published for long are dropped."""
        with self._lock:
            recent = self._now() - PUBLISHER_TIMEOUT
            self._by_name = {each: known for each, known in self._by_name.items() if known.arrival >= recent}
            publisher = RosPublisher(name)
            if len(self._by_name) < SENDERS:
                self._by_name[name] = publisher
            self.publishers = tuple(self._by_name.values())
        return publisher

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        return self.read_from(self._all)

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        return self.publishers

    def read_from(self, publisher: RosPublisher) -> MessageStatus:
        """See `Reader.read_from`."""
        newest = publisher.newest
        if newest is not publisher.taken:
            publisher.taken = newest
            return self._receive(newest)
        return NONE if self.message is None else OLD

    def read_next(self) -> RosPublisher | None:
        """See `Reader.read_next`."""
        waiting = self._waiting
        if not waiting and self._backlog is not None:
            waiting.extend(self._backlog.drain())
        while waiting:
            arrival, publisher = waiting.popleft()
            if self._receive(arrival) is NEW:
                return publisher
        return None

    def awaited(self) -> list[str]:
        """See `Reader.awaited`."""
        return self._expected.awaited(self._by_name)

    def _receive(self, arrival: Arrival) -> MessageStatus:
        try:
            self.message = self._decode(arrival.packed, arrival.sender)
        except PipeError as error:
            self.subscription.refuse(arrival.sender, error)
            self.refused += 1
            return NONE if self.message is None else OLD
        self.arrival = arrival.time
        return NEW

    def age(self) -> float:
        """See `Reader.age`."""
        return self._now() - self.arrival

    def close(self) -> None:
        """Unregister."""
        self.subscription.close()


class RosQueue(Queue):
    """Every message of a topic.

    Attributes:
        subscription: Where the messages come from.
    """

    def __init__(self, topic: str, message: str, size: int, largest: int | None = None):
        self._backlog: Backlog[Arrival] = Backlog(size)
        self.waits = self._backlog.waiting
        self.subscription = Subscription(topic, message, size, store=self._store, largest=largest)
        self.topic = self.subscription.topic

    def _store(self, arrival: Arrival) -> None:
        self._backlog.put(arrival.sender, arrival)

    @property
    def dropped(self) -> int:
        """See `Queue.dropped`."""
        return self._backlog.dropped + self.subscription.oversized

    def drain(self) -> list[Message]:
        """See `Queue.drain`."""
        return self._decoded(self._backlog.drain()) if self.waits else []

    def take(self, first: Container[str], most: int, others: int) -> list[Message]:
        """See `Queue.take`; messages that are dropped are not decoded."""
        return self._decoded(self._backlog.take(first, most, others))

    def _decoded(self, arrivals: list[Arrival]) -> list[Message]:
        decoded = (self.subscription.decode(arrival) for arrival in arrivals)
        return [message for message in decoded if message is not None]

    def close(self) -> None:
        """Unregister."""
        self.subscription.close()


class RosWriter(Writer):
    """A topic to write to; of messages that a slow subscriber has not received yet only the newest is kept.

    Attributes:
        topic_publisher: Where the messages go.
    """

    def __init__(self, topic: str, message: str):
        self._codec = codec(message)
        self.topic_publisher = TopicPublisher(topic, self._codec.ros_class)
        self.topic = self.topic_publisher.topic
        self.carries = self._codec.ros_class._type

    def write(self, message: Message) -> None:
        """See `Writer.write`.

        Raises:
            MiddlewareError: The topic was closed.
        """
        if self.topic_publisher.has_subscribers():
            self.topic_publisher.send(self._codec.encode(message))

    def flush(self) -> bool:
        """Send what waits; returns whether every message has been passed to the operating system."""
        return self.topic_publisher.flush()

    def close(self) -> None:
        """Unregister."""
        self.topic_publisher.close()
