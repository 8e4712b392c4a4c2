"""Topics whose messages arrive as bytes, which the thread that reads decodes: the newest message, or every one."""

import abc
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Container, Sequence
from typing import Any, NamedTuple

from solfer.errors import PipeError
from solfer.throttle import Throttle
from solfer.transport.backlog import SENDERS, Backlog
from solfer.transport.endpoints import NEW, NONE, OLD, PUBLISHER_TIMEOUT, MessageStatus, Publisher, Queue, Reader
from solfer.transport.messages import Message

logger = logging.getLogger(__name__)


class Arrival(NamedTuple):
    """A message as it came in, and when by the reader's clock [s]."""

    packed: bytes
    sender: str
    time: float


class Arrivals(abc.ABC):
    """Where the messages of a topic come from, and what decodes them.

    Args:
        codec: Its `decode(packed, sender)` returns a message, or raises a PipeError.
        now: Clock of the reader [s].
        largest: Bytes of a message; a larger one is dropped undecoded. None: any size.

    Attributes:
        topic: Resolved name.
        codec: As given.
        now: As given.
        largest: As given.
        oversized: Messages that were too large.
    """

    topic: str

    def __init__(self, codec: Any, now: Callable[[], float] = time.monotonic, *, largest: int | None = None):
        self.codec = codec
        self.now = now
        self.largest = largest
        self.oversized = 0
        self._throttle = Throttle(logger)

    def decode(self, arrival: Arrival) -> Message | None:
        """Decode a message; None if it is refused, which is logged once a second for each sender."""
        try:
            message: Message = self.codec.decode(arrival.packed, arrival.sender)
        except PipeError as error:
            self._throttle.warning(
                arrival.sender, "topic %s: a message of %s is refused: %s", self.topic, arrival.sender, error
            )
            return None
        return message

    def refuse_size(self, sender: str, size: int) -> None:
        """Count a message that is too large, and log it once a second for each sender."""
        self.oversized += 1
        self._throttle.warning(
            sender,
            "topic %s: a message of %s with %d bytes is dropped: %d bytes at most",
            self.topic,
            sender,
            size,
            self.largest,
        )

    @abc.abstractmethod
    def close(self) -> None:
        """Unsubscribe."""


class ArrivalPublisher(Publisher):
    """A node that publishes on a topic, as one reader knows it.

    Attributes:
        newest: Its newest message, None before the first.
        taken: The one that was read last.
    """

    def __init__(self, name: str):
        super().__init__(name)
        self.newest: Arrival | None = None
        self.taken: Arrival | None = None


class ArrivalReader(Reader):
    """The newest message of a topic, or each of them; `_store` may be called in any thread.

    Args:
        now: Clock in which the age of a message counts [s].
        kept: See `Middleware.reader`.

    Attributes:
        subscription: Where the messages come from; to be set by a subclass.
    """

    subscription: Arrivals

    def __init__(self, now: Callable[[], float], kept: int):
        self._now = now
        self._all = ArrivalPublisher("")
        self._lock = threading.Lock()
        self._by_name: dict[str, ArrivalPublisher] = {}
        self._backlog: Backlog[tuple[Arrival, ArrivalPublisher]] | None = Backlog(kept) if kept else None
        self._waiting = deque[tuple[Arrival, ArrivalPublisher]]()

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

    def _add(self, name: str) -> ArrivalPublisher:
        """Add a node that publishes for the first time; those that have not published for long are dropped."""
        with self._lock:
            recent = self._now() - PUBLISHER_TIMEOUT
            self._by_name = {each: known for each, known in self._by_name.items() if known.arrival >= recent}
            publisher = ArrivalPublisher(name)
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

    def read_from(self, publisher: ArrivalPublisher) -> MessageStatus:
        """See `Reader.read_from`."""
        newest = publisher.newest
        if newest is not None and newest is not publisher.taken:
            publisher.taken = newest
            return self._receive(newest)
        return NONE if self.message is None else OLD

    def read_next(self) -> ArrivalPublisher | None:
        """See `Reader.read_next`."""
        waiting = self._waiting
        if not waiting and self._backlog is not None:
            waiting.extend(self._backlog.drain())
        while waiting:
            arrival, publisher = waiting.popleft()
            if self._receive(arrival) is NEW:
                return publisher
        return None

    def _receive(self, arrival: Arrival) -> MessageStatus:
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


class ArrivalQueue(Queue):
    """Every message of a topic; `_store` may be called in any thread.

    Args:
        size: Messages of one sender that may wait.

    Attributes:
        subscription: Where the messages come from; to be set by a subclass.
    """

    subscription: Arrivals

    def __init__(self, size: int):
        self._backlog: Backlog[Arrival] = Backlog(size)

    def _store(self, arrival: Arrival) -> None:
        self._backlog.put(arrival.sender, arrival)

    @property
    def dropped(self) -> int:  # type: ignore[override]
        """See `Queue.dropped`."""
        return self._backlog.dropped + self.subscription.oversized

    def drain(self) -> list[Message]:
        """See `Queue.drain`."""
        return self._decoded(self._backlog.drain())

    def take(self, first: Container[str], most: int, others: int) -> list[Message]:
        """See `Queue.take`; messages that are dropped are not decoded."""
        return self._decoded(self._backlog.take(first, most, others))

    def _decoded(self, arrivals: list[Arrival]) -> list[Message]:
        decoded = (self.subscription.decode(arrival) for arrival in arrivals)
        return [message for message in decoded if message is not None]

    def close(self) -> None:
        """Unsubscribe."""
        self.subscription.close()
