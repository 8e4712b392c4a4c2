"""Topics: the newest message, every message, and their writers.

rospy's receiving threads only store bytes; what is read is decoded in the thread that reads. Nagle's algorithm is off
on both ends: with it, messages of the size of a joint state arrive in pairs and up to 40 ms late.
"""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import genpy
import rospy
from rospy.impl.tcpros_base import TCPROSTransport

from solfer.errors import MiddlewareError
from solfer.middleware.ros.codecs.bounded import bound_messages
from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH
from solfer.middleware.ros.codecs.table import codec
from solfer.middleware.ros.node.expected_publishers import ExpectedPublishers
from solfer.middleware.ros.topic_publisher import TopicPublisher
from solfer.transport import Writer
from solfer.transport.arrivals import Arrival, ArrivalQueue, ArrivalReader, Arrivals
from solfer.transport.backlog import SENDERS
from solfer.transport.lockstep.client import LOCKSTEP_TIMEOUT
from solfer.transport.messages import Message


class Subscription(Arrivals):
    """Hands every message of a topic to `store`.

    Args:
        topic: Name of the topic.
        message: Canonical name of the message.
        size: Messages that may wait between two runs of rospy's receiving thread.
        store: Called in rospy's thread.
        now: Clock of the reader [s].
        largest: Bytes of a message; a larger one is dropped undecoded. None: any size.

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
        super().__init__(codec(message), now, largest=largest)
        self._store = store
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
            bound_messages(connection.protocol, largest, lambda size: self.refuse_size(connection.callerid_pub, size))
            return add(connection)

        implementation.add_connection = add_bounded
        for connection in implementation.connections:
            bound_messages(connection.protocol, largest, partial(self.refuse_size, connection.callerid_pub))

    def _receive(self, message: genpy.Message) -> None:
        sender = message._connection_header["callerid"]
        if self.largest is not None and len(message.packed) > self.largest:
            self.refuse_size(sender, len(message.packed))
            return
        self._store(Arrival(message.packed, sender, self.now()))
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

    def close(self) -> None:
        """Unregister."""
        self._subscriber.unregister()


class RosReader(ArrivalReader):
    """The newest message of a topic, or each of them.

    Args:
        topic: Name of the topic.
        message: Canonical name of its message.
        now: Clock in which its age counts [s].
        kept: See `Middleware.reader`.
        in_lockstep: Whether all that is read depends on simulated time only, however long the master takes to answer.
    """

    subscription: Subscription

    def __init__(
        self,
        topic: str,
        message: str,
        now: Callable[[], float] = time.monotonic,
        kept: int = 0,
        in_lockstep: bool = False,
    ):
        super().__init__(now, kept)
        # messages without a header have no number, and are counted: none may be left out
        size = 1 if codec(message).ros_class._has_header and not kept else max(kept, 256)
        self.subscription = Subscription(topic, message, size, store=self._store, now=now)
        self.topic = self.subscription.topic
        self.carries = self.subscription.codec.ros_class._type
        self._expected = ExpectedPublishers(
            self.topic,
            self.subscription.senders,
            now=now if in_lockstep else time.monotonic,
            timeout=LOCKSTEP_TIMEOUT if in_lockstep else 0.1,  # a cycle of real time cannot wait longer
        )

    def awaited(self) -> list[str]:
        """See `Reader.awaited`."""
        return self._expected.awaited(self._by_name)


class RosQueue(ArrivalQueue):
    """Every message of a topic."""

    subscription: Subscription

    def __init__(self, topic: str, message: str, size: int, largest: int | None = None):
        super().__init__(size)
        self.waits = self._backlog.waiting
        self.subscription = Subscription(topic, message, size, store=self._store, largest=largest)
        self.topic = self.subscription.topic


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
