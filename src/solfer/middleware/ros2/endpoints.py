"""Topics: the newest message, every message, and their writers.

Messages wait in the middleware of ROS 2 until they are read: bytes of a bounded count, which the thread that reads
takes and decodes. Without an executor a message costs neither a thread's wake-up nor a callback.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Container, Sequence
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile

from solfer.errors import MiddlewareError
from solfer.middleware.ros2.codecs import StampOf, codec
from solfer.middleware.ros2.quality import quality
from solfer.transport.arrivals import Arrival, ArrivalPublisher, ArrivalQueue, ArrivalReader, Arrivals
from solfer.transport.backlog import SENDERS
from solfer.transport.endpoints import MessageStatus, Publisher, Writer
from solfer.transport.messages import Message

DEPTH = 64
"""Messages that wait for a reader that is late; of two publishers none crowds out the other's newest."""

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""Name of a node of which only its topics are known so far."""

NAMING_TIMEOUT = 1.0
"""Longest time that a message waits for the name of its sender, which comes on another way [s]."""


class Polled(CallbackGroup):
    """Keeps an executor from taking messages of topics that are read without one."""

    def can_execute(self, entity: Any) -> bool:
        """Return False: no callback is to run."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Return False, as above."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Do nothing, as above."""


class Ros2Subscription(Arrivals):
    """The messages of a topic, as bytes.

    Args:
        node: The node.
        topic: Name of the topic.
        message: Canonical name of the message.
        quality: What is required of publishers.
        now: Clock of the reader [s].
        largest: Bytes of a message; a larger one is dropped undecoded. None: any size.

    Attributes:
        store: Gets the messages.

    Raises:
        MiddlewareError: There can be no such topic.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        message: str,
        quality: QoSProfile,
        now: Callable[[], float] = time.monotonic,
        *,
        largest: int | None = None,
    ):
        super().__init__(codec(message), now, largest=largest)
        self._node = node
        self._names: dict[bytes, str] = {}
        self._numbers: dict[str, int] = {}
        self.store: Callable[[Arrival], None] = ignore
        self._newest = -math.inf
        self._unnamed: deque[tuple[bytes, dict[str, Any]]] = deque()
        try:
            self._subscription = node.create_subscription(
                self.codec.ros_class, topic, ignore, quality, callback_group=Polled(), raw=True
            )
        except Exception as error:  # rclpy has one class for each mistake in a name
            raise MiddlewareError(
                f"topic '{topic}' cannot be read as {message}: {error}", expected="the name of a topic of this message"
            ) from error
        self.topic = self._subscription.topic_name
        self._depth = quality.depth
        self._take = self._subscription.handle.take_message

    def poll(self) -> None:
        """Hand what has come since the last call to `store`, at most as many messages as may wait."""
        self._time = self.now()
        self._wall = time.time_ns()
        while self._unnamed:  # in their order: what comes behind them waits
            arrival = self._arrival(*self._unnamed[0])
            if arrival is None:
                break
            self._unnamed.popleft()
            self.store(arrival)
        for _ in range(self._depth):
            taken = self._take(self.codec.ros_class, True)
            if taken is None:
                break
            packed, info = taken
            if self.largest is not None and len(packed) > self.largest:
                self.refuse_size(self._sender(info, NAMING_TIMEOUT) or "", len(packed))
                continue
            arrival = None if self._unnamed else self._arrival(packed, info)
            if arrival is not None:
                self.store(arrival)
            elif len(self._unnamed) < self._depth:
                self._unnamed.append((packed, info))

    def _arrival(self, packed: bytes, info: dict[str, Any]) -> Arrival | None:
        """Make the arrival of a message; None while the name of its sender is not known."""
        late = max(0.0, 1e-9 * (self._wall - info["received_timestamp"]))
        sender = self._sender(info, late)
        if sender is None:
            return None
        if sender not in self._numbers and len(self._numbers) >= SENDERS:
            self._numbers.pop(next(iter(self._numbers)))
        self._numbers[sender] = info["publication_sequence_number"]
        self._newest = max(self._newest, self._time - late)  # threads of the middleware may pass each other
        return Arrival(packed, sender, self._newest)

    def _sender(self, info: dict[str, Any], waited: float) -> str | None:
        """Return the name of a message's sender; None: it is not known yet."""
        gid = bytes(info["publisher_gid"]["data"])
        name = self._names.get(gid)
        if name is not None:
            return name
        for each in self._node.get_publishers_info_by_topic(self.topic):
            if each.node_name != UNNAMED and bytes(each.endpoint_gid) == gid:
                name = f"{each.node_namespace.rstrip('/')}/{each.node_name}"
        if name is None and waited < NAMING_TIMEOUT:
            return None
        if len(self._names) >= SENDERS:
            self._names.pop(next(iter(self._names)))
        self._names[gid] = name = name or gid.hex()
        return name

    def number(self, sender: str, before: int = 0) -> int:
        """Return the number of a sender's newest message, zero before the first; those of before count, too.

        To be called while no other thread reads the topic.
        """
        self.poll()
        return self._numbers.get(sender, 0)

    def others(self) -> set[str]:
        """Return the names of the nodes that publish."""
        return _names(self._node.get_publishers_info_by_topic(self.topic))

    def senders(self) -> set[str]:
        """Return the names of the nodes that are connected; none before all are."""
        known = self._node.get_publishers_info_by_topic(self.topic)
        return _names(known) if self._subscription.handle.get_publisher_count() >= len(known) else set()

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)


def _names(ends: Sequence[Any]) -> set[str]:
    """Return the full names of the nodes of ends of a topic."""
    return {f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in ends}


def ignore(_: Any) -> None:
    """Stand in for a callback that never runs."""


class Ros2Reader(ArrivalReader):
    """The newest message of a topic, or each of them.

    Args:
        node: The node.
        topic: Name of the topic.
        message: Canonical name of its message.
        now: Clock in which its age counts [s].
        kept: See `Middleware.reader`.
        latched: Whether the newest message of before counts.
        reliable: Whether no message may be lost, and their publishers have to be reliable.
    """

    receives = True
    subscription: Ros2Subscription

    def __init__(
        self,
        node: Node,
        topic: str,
        message: str,
        now: Callable[[], float] = time.monotonic,
        *,
        kept: int = 0,
        latched: bool = False,
        reliable: bool = False,
    ):
        super().__init__(now, kept)
        self.requires = quality(max(4 * kept, DEPTH), reliable=reliable or latched, latched=latched)
        self.subscription = Ros2Subscription(node, topic, message, self.requires, now=now)
        self.subscription.store = self._store
        self.topic = self.subscription.topic
        self.carries = message

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        self.subscription.poll()
        return super().read()

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        self.subscription.poll()
        return self.publishers

    def read_next(self) -> ArrivalPublisher | None:
        """See `Reader.read_next`."""
        if not self._waiting:
            self.subscription.poll()
        return super().read_next()


class Ros2Queue(ArrivalQueue):
    """Every message of a topic."""

    receives = True
    subscription: Ros2Subscription

    def __init__(self, node: Node, topic: str, message: str, size: int, largest: int | None = None):
        super().__init__(size)
        self.requires = quality(max(4 * size, DEPTH), reliable=True)
        self.subscription = Ros2Subscription(node, topic, message, self.requires, largest=largest)
        self.subscription.store = self._store
        self.topic = self.subscription.topic

    def drain(self) -> list[Message]:
        """See `Queue.drain`."""
        self.subscription.poll()
        return super().drain()

    def take(self, first: Container[str], most: int, others: int) -> list[Message]:
        """See `Queue.take`."""
        self.subscription.poll()
        return super().take(first, most, others)


class Ros2Writer(Writer):
    """A topic to write to.

    Args:
        node: The node.
        topic: Name of the topic.
        message: Canonical name of its message.
        stamp_of: Stamps what is written.

    Raises:
        MiddlewareError: There can be no such topic.
    """

    receives = False

    def __init__(self, node: Node, topic: str, message: str, stamp_of: StampOf):
        self._node = node
        self._codec = codec(message, stamp_of)
        self.carries = message
        self.requires = quality(DEPTH, reliable=True)
        try:
            self._publisher = node.create_publisher(self._codec.ros_class, topic, self.requires)
        except Exception as error:  # rclpy has one class for each mistake in a name
            raise MiddlewareError(
                f"topic '{topic}' cannot be written as {message}: {error}", expected="the name of a topic"
            ) from error
        self.topic = self._publisher.topic_name
        self.topic_publisher = self  # as on ROS 1, where several writers share one
        self._sent = 0

    def number(self) -> int:
        """Return how many messages were sent; subscribers get that number with the newest."""
        return self._sent

    def others(self) -> set[str]:
        """Return the names of the nodes that subscribe."""
        return _names(self._node.get_subscriptions_info_by_topic(self.topic))

    def receivers(self) -> set[str]:
        """Return the names of the nodes that are connected; none before all are."""
        known = self._node.get_subscriptions_info_by_topic(self.topic)
        return _names(known) if self._publisher.get_subscription_count() >= len(known) else set()

    def write(self, message: Message) -> None:
        """See `Writer.write`."""
        if self._publisher.get_subscription_count():
            self._publisher.publish(self._codec.encode(message))
            self._sent += 1

    def close(self) -> None:
        """End the topic."""
        self._node.destroy_publisher(self._publisher)
