"""Topics: the newest message, every message, and their writers.

Messages wait in the middleware of ROS 2 until they are read: bytes of a bounded count, which the thread that reads
takes and decodes. Without an executor a message costs neither a thread's wake-up nor a callback.
"""

import logging
import math
import time
from collections import deque
from collections.abc import Callable, Container, Sequence
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile

from solfer.errors import MiddlewareError, PipeError
from solfer.middleware.ros2.codecs import CdrCodec, StampOf, codec
from solfer.middleware.ros2.quality import quality
from solfer.throttle import Throttle
from solfer.transport.backlog import SENDERS, Backlog
from solfer.transport.endpoints import (
    NEW,
    NONE,
    OLD,
    PUBLISHER_TIMEOUT,
    MessageStatus,
    Publisher,
    Queue,
    Reader,
    Writer,
)
from solfer.transport.messages import Message

logger = logging.getLogger(__name__)

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


class PackedArrival(NamedTuple):
    """A message as it came in, and when by the reader's clock [s]."""

    packed: bytes
    sender: str
    time: float


class Ros2Subscription:
    """The messages of a topic, as bytes.

    Args:
        node: The node.
        topic: Name of the topic.
        message: Canonical name of the message.
        quality: What is required of publishers.
        now: Clock of the reader [s].
        largest: Bytes of a message; a larger one is dropped undecoded. None: any size.

    Attributes:
        topic: Resolved name.
        codec: Decodes what is taken.
        oversized: Messages that were too large.

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
        self.codec: CdrCodec = codec(message)
        self.oversized = 0
        self._node = node
        self._now = now
        self._largest = largest
        self._throttle = Throttle(logger)
        self._names: dict[bytes, str] = {}
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

    def take(self) -> list[PackedArrival]:
        """Take what has come since the last call, at most as many messages as may wait."""
        arrivals: list[PackedArrival] = []
        self._time = self._now()
        self._wall = time.time_ns()
        while self._unnamed:  # in their order: what comes behind them waits
            arrival = self._arrival(*self._unnamed[0])
            if arrival is None:
                break
            self._unnamed.popleft()
            arrivals.append(arrival)
        for _ in range(self._depth):
            taken = self._take(self.codec.ros_class, True)
            if taken is None:
                break
            packed, info = taken
            if self._largest is not None and len(packed) > self._largest:
                self._refuse_size(info, len(packed))
                continue
            arrival = None if self._unnamed else self._arrival(packed, info)
            if arrival is not None:
                arrivals.append(arrival)
            elif len(self._unnamed) < self._depth:
                self._unnamed.append((packed, info))
        return arrivals

    def _arrival(self, packed: bytes, info: dict[str, Any]) -> PackedArrival | None:
        """Make the arrival of a message; None while the name of its sender is not known."""
        late = max(0.0, 1e-9 * (self._wall - info["received_timestamp"]))
        sender = self._sender(info, late)
        if sender is None:
            return None
        self._newest = max(self._newest, self._time - late)  # threads of the middleware may pass each other
        return PackedArrival(packed, sender, self._newest)

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

    def _refuse_size(self, info: dict[str, Any], size: int) -> None:
        self.oversized += 1
        sender = self._sender(info, NAMING_TIMEOUT) or ""
        self._throttle.warning(
            sender,
            "topic %s: a message of %s with %d bytes is dropped: %d bytes at most",
            self.topic,
            sender,
            size,
            self._largest,
        )

    def senders(self) -> int:
        """Return how many publishers are connected."""
        return self._subscription.handle.get_publisher_count()

    def decode(self, arrival: PackedArrival) -> Message | None:
        """Decode a message; None if it is refused, which is logged once a second for each sender."""
        try:
            return self.codec.decode(arrival.packed, arrival.sender)
        except PipeError as error:
            self._throttle.warning(
                arrival.sender, "topic %s: a message of %s is refused: %s", self.topic, arrival.sender, error
            )
            return None

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)


def ignore(_: Any) -> None:
    """Stand in for a callback that never runs."""


class Ros2Publisher(Publisher):
    """A node that publishes on a topic, as one reader knows it.

    Attributes:
        newest: Its newest message, None before the first.
        taken: The one that was read last.
    """

    def __init__(self, name: str):
        super().__init__(name)
        self.newest: PackedArrival | None = None
        self.taken: PackedArrival | None = None


class Ros2Reader(Reader):
    """The newest message of a topic, or each of them.

    Args:
        node: The node.
        topic: Name of the topic.
        message: Canonical name of its message.
        now: Clock in which its age counts [s].
        kept: See `Middleware.reader`.
        latched: Whether the newest message of before counts.
    """

    receives = True

    def __init__(
        self,
        node: Node,
        topic: str,
        message: str,
        now: Callable[[], float] = time.monotonic,
        *,
        kept: int = 0,
        latched: bool = False,
    ):
        self._all = Ros2Publisher("")
        self._now = now
        self._by_name: dict[str, Ros2Publisher] = {}
        self._backlog: Backlog[tuple[PackedArrival, Ros2Publisher]] | None = Backlog(kept) if kept else None
        self._waiting = deque[tuple[PackedArrival, Ros2Publisher]]()
        self.requires = quality(max(4 * kept, DEPTH), reliable=latched, latched=latched)
        self.subscription = Ros2Subscription(node, topic, message, self.requires, now=now)
        self.topic = self.subscription.topic
        self.carries = message

    def _poll(self) -> None:
        """Take what has come."""
        for arrival in self.subscription.take():
            publisher = self._by_name.get(arrival.sender) or self._add(arrival.sender)
            self._all.newest = publisher.newest = arrival
            publisher.arrival = arrival.time
            if self._backlog is not None:
                self._backlog.put(arrival.sender, (arrival, publisher))

    @property
    def dropped(self) -> int:  # type: ignore[override]
        """See `Reader`."""
        return 0 if self._backlog is None else self._backlog.dropped

    def _add(self, name: str) -> Ros2Publisher:
        """Add a node that publishes for the first time; those that have not published for long are dropped."""
        recent = self._now() - PUBLISHER_TIMEOUT
        self._by_name = {each: known for each, known in self._by_name.items() if known.arrival >= recent}
        publisher = Ros2Publisher(name)
        if len(self._by_name) < SENDERS:
            self._by_name[name] = publisher
        self.publishers = tuple(self._by_name.values())
        return publisher

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        self._poll()
        return self.read_from(self._all)

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        self._poll()
        return self.publishers

    def read_from(self, publisher: Ros2Publisher) -> MessageStatus:
        """See `Reader.read_from`."""
        newest = publisher.newest
        if newest is not None and newest is not publisher.taken:
            publisher.taken = newest
            return self._receive(newest)
        return NONE if self.message is None else OLD

    def read_next(self) -> Ros2Publisher | None:
        """See `Reader.read_next`."""
        waiting = self._waiting
        if not waiting and self._backlog is not None:
            self._poll()
            waiting.extend(self._backlog.drain())
        while waiting:
            arrival, publisher = waiting.popleft()
            if self._receive(arrival) is NEW:
                return publisher
        return None

    def _receive(self, arrival: PackedArrival) -> MessageStatus:
        message = self.subscription.decode(arrival)
        if message is None:
            self.refused += 1
            return NONE if self.message is None else OLD
        self.message = message
        self.arrival = arrival.time
        return NEW

    def age(self) -> float:
        """See `Reader.age`."""
        return self._now() - self.arrival

    def close(self) -> None:
        """Unsubscribe."""
        self.subscription.close()


class Ros2Queue(Queue):
    """Every message of a topic."""

    receives = True

    def __init__(self, node: Node, topic: str, message: str, size: int, largest: int | None = None):
        self._backlog: Backlog[PackedArrival] = Backlog(size)
        self.requires = quality(max(4 * size, DEPTH), reliable=True)
        self.subscription = Ros2Subscription(node, topic, message, self.requires, largest=largest)
        self.topic = self.subscription.topic

    @property
    def dropped(self) -> int:
        """See `Queue.dropped`."""
        return self._backlog.dropped + self.subscription.oversized

    def drain(self) -> list[Message]:
        """See `Queue.drain`."""
        self._poll()
        return self._decoded(self._backlog.drain())

    def take(self, first: Container[str], most: int, others: int) -> list[Message]:
        """See `Queue.take`; messages that are dropped are not decoded."""
        self._poll()
        return self._decoded(self._backlog.take(first, most, others))

    def _poll(self) -> None:
        for arrival in self.subscription.take():
            self._backlog.put(arrival.sender, arrival)

    def _decoded(self, arrivals: list[PackedArrival]) -> list[Message]:
        decoded = (self.subscription.decode(arrival) for arrival in arrivals)
        return [message for message in decoded if message is not None]

    def close(self) -> None:
        """Unsubscribe."""
        self.subscription.close()


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

    def receivers(self) -> int:
        """Return how many nodes' subscriptions are connected."""
        return self._publisher.get_subscription_count()

    def write(self, message: Message) -> None:
        """See `Writer.write`."""
        if self.receivers():
            self._publisher.publish(self._codec.encode(message))

    def close(self) -> None:
        """End the topic."""
        self._node.destroy_publisher(self._publisher)
