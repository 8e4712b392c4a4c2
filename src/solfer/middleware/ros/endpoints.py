"""Topics: the newest message, every message, and a way to write.

rospy's receiving threads only store bytes; what is read is decoded in the thread that reads. Nagle's algorithm is off
on both ends: with it, messages of the size of a joint state arrive in pairs and up to 40 ms late.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import genpy
import rospy

from solfer.errors import MiddlewareError, PipeError
from solfer.logs import Throttle
from solfer.middleware.ros.codecs import Codec, codec
from solfer.middleware.ros.frame import LENGTH
from solfer.middleware.ros.outlet import Outlet
from solfer.pipes import Queue, Reader, Status, Writer
from solfer.pipes.messages import Message

logger = logging.getLogger(__name__)


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
        size: Messages that may wait between two turns of rospy's receiving thread.
        store: Called in rospy's thread.
        now: Clock of the reader [s].

    Raises:
        MiddlewareError: The topic is used in this process with another message.
    """

    def __init__(self, topic: str, message: str, size: int, store, now: Callable[[], float] = time.monotonic):
        self._codec: Codec = codec(message)
        self._store, self._now, self._throttle = store, now, Throttle(logger)
        self._newest: dict[str, bytes] = {}
        try:
            self._subscriber = rospy.Subscriber(
                topic, self._codec.ros_class, self._take, queue_size=size, tcp_nodelay=True
            )
        except rospy.ROSException as error:
            raise MiddlewareError(f"topic '{topic}' cannot be read as {message}: {error}") from error
        self.topic = self._subscriber.resolved_name

    def _take(self, message: genpy.Message) -> None:
        sender = message._connection_header["callerid"]
        self._store(Arrival(message.packed, sender, self._now()))
        self._newest[sender] = message.packed

    def number(self, sender: str) -> int:
        """Number of the newest message of a sender; zero before the first. Only messages with a header have one."""
        packed = self._newest.get(sender)
        return 0 if packed is None else LENGTH.unpack_from(packed)[0]

    def senders(self) -> set[str]:
        """Names of the nodes that are connected."""
        return {connection.callerid_pub for connection in self._subscriber.impl.connections}

    def decode(self, arrival: Arrival) -> Message | None:
        """The message, or None for one that is refused; the refusal is logged once a second for each sender."""
        try:
            return self._codec.decode(arrival.packed, arrival.sender)
        except PipeError as error:
            self._throttle.warning(
                arrival.sender, "topic %s: a message of %s is refused: %s", self.topic, arrival.sender, error
            )
            return None

    def close(self) -> None:
        """Unregister."""
        self._subscriber.unregister()


class RosReader(Reader):
    """The newest message of a topic; its age counts in the clock `now`.

    Attributes:
        subscription: Where the messages come from.
    """

    def __init__(self, topic: str, message: str, now: Callable[[], float] = time.monotonic):
        super().__init__()
        self._newest: Arrival | None = None
        self._taken: Arrival | None = None
        self._now = now
        self.subscription = Subscription(topic, message, 1, self._store, now)
        self.topic = self.subscription.topic

    def _store(self, arrival: Arrival) -> None:
        self._newest = arrival
        self.senders[arrival.sender] = arrival.time

    def read(self) -> Status:
        """See `Reader.read`."""
        newest = self._newest
        if newest is not self._taken:
            self._taken = newest
            message = self.subscription.decode(newest)
            if message is not None:
                self.message, self.arrival = message, newest.time
                return Status.NEW
            self.refused += 1
        return Status.NONE if self.message is None else Status.OLD

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

    def __init__(self, topic: str, message: str, size: int):
        self._arrivals: deque[Arrival] = deque(maxlen=size)
        self._lock = threading.Lock()
        self.subscription = Subscription(topic, message, size, self._store)
        self.topic = self.subscription.topic

    def _store(self, arrival: Arrival) -> None:
        with self._lock:
            self.dropped += len(self._arrivals) == self._arrivals.maxlen
            self._arrivals.append(arrival)

    def drain(self) -> list[Message]:
        """See `Queue.drain`."""
        if not self._arrivals:
            return []
        with self._lock:
            arrivals = list(self._arrivals)
            self._arrivals.clear()
        decoded = (self.subscription.decode(arrival) for arrival in arrivals)
        return [message for message in decoded if message is not None]

    def close(self) -> None:
        """Unregister."""
        self.subscription.close()


class RosWriter(Writer):
    """A topic to write to; of messages that a slow subscriber has not taken yet only the newest is kept.

    Attributes:
        outlet: Where the messages go.
    """

    def __init__(self, topic: str, message: str):
        self._codec = codec(message)
        self.outlet = Outlet(topic, self._codec.ros_class)
        self.topic = self.outlet.topic

    def write(self, message: Message) -> None:
        """See `Writer.write`.

        Raises:
            MiddlewareError: The topic was closed.
        """
        if self.outlet.heard():
            self.outlet.send(self._codec.encode(message))

    def flush(self) -> bool:
        """Whether every message has been handed to the operating system."""
        return self.outlet.flush()

    def close(self) -> None:
        """Unregister."""
        self.outlet.close()
