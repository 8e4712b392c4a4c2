"""Ends of topics: read the newest message, read every message, write."""

import abc
import enum
import math
from collections.abc import Container, Sequence
from typing import Any

from solfer.transport.clocks.sender_clock import SenderClock
from solfer.transport.messages import Message


class MessageStatus(enum.IntEnum):
    """Result of a read: no message yet, the message that was known already, or a new one."""

    NONE = 0
    OLD = 1
    NEW = 2


# module globals: the lookup in the control cycle is five times as fast as on the class
NONE, OLD, NEW = MessageStatus


PUBLISHER_TIMEOUT = 1.0
"""A publisher counts as active for this time after its newest message [s]."""


class Publisher:
    """A publisher of a topic, as a reader sees it.

    Args:
        name: Its name.

    Attributes:
        name: Its name.
        arrival: When its newest message arrived, in the pipe's own clock [s]; minus infinity before the first.
        clock: Finds when the numbers of its messages were true.
    """

    def __init__(self, name: str):
        self.name = name
        self.clock = SenderClock()
        self.arrival = -math.inf


class Reader(abc.ABC):
    """The newest message of a topic: of all that publish there (`read`), or of each of them (`read_from`).

    A reader that was made to keep messages has each of them once instead (`read_next`). A pipe does one of these.

    Attributes:
        topic: Resolved name of the topic.
        carries: Type of its messages, by the middleware's name; empty: no other node can be on this topic.
        message: Newest message read, None until the first; it stays the same until the next read of any kind.
        arrival: When `message` arrived, in the pipe's own clock [s]; minus infinity before the first.
        refused: Messages that were not of this topic's type, or contradicted themselves.
        has_next: Whether another message may wait for `read_next`, as of the last one.
        dropped: Messages that `read_next` missed because more had come than are kept.
        publishers: All that have published on the topic, the first one first, as of the last `read`, `read_next` or
            `update`.
    """

    topic: str
    carries: str = ""
    message: Any = None
    arrival: float = -math.inf
    refused: int = 0
    has_next: bool = True
    dropped: int = 0
    publishers: Sequence[Publisher] = ()

    @abc.abstractmethod
    def read(self) -> MessageStatus:
        """Fetch the newest message of all publishers into `message`. Does not block."""

    @abc.abstractmethod
    def update(self) -> Sequence[Publisher]:
        """Update `publishers`, and return them. Does not block."""

    @abc.abstractmethod
    def read_from(self, publisher: Publisher) -> MessageStatus:
        """Fetch the newest message of one of the `publishers` into `message`. Does not block."""

    def read_next(self) -> Publisher | None:
        """Fetch the oldest message that was not read into `message`, and return its publisher; None: there is none.

        Does not block. This default, for topics with at most one message a cycle, fetches the newest of a publisher.
        """
        return next((each for each in self.update() if self.read_from(each) is NEW), None)

    @abc.abstractmethod
    def age(self) -> float:
        """Return the time since `message` arrived, in the pipe's own clock [s]; infinity before the first."""

    def awaited(self) -> list[str]:
        """List known publishers without a message so far, which may publish at any moment; sorted.

        May block for a moment, so not for the cycle. Empty where a publisher is seen as soon as it exists.
        """
        return []

    def recent_senders(self, since: float) -> list[str]:
        """List the publishers with a message since a time [s], sorted."""
        return sorted(publisher.name for publisher in self.publishers if publisher.arrival >= since)


class JointOrder:
    """Names of the joints in the messages of a joint-space topic: those of the first message, then others as they come.

    Args:
        reader: Receives the messages.

    Attributes:
        names: The names.
    """

    def __init__(self, reader: Reader):
        self._reader = reader
        self.names: dict[str, None] = {}

    def read(self) -> bool:
        """Read the newest message of each publisher; return whether all known publishers have published."""
        for publisher in self._reader.update():
            if self._reader.read_from(publisher) is NEW:
                self.names |= dict.fromkeys(self._reader.message.names)
        return bool(self.names) and not self._reader.awaited()


class Queue(abc.ABC):
    """Every message of a topic, in order of arrival; when the queue is full the oldest is dropped and counted.

    Attributes:
        topic: Resolved name of the topic.
        dropped: Messages that were lost.
        waits: What is true while messages may wait, and false only if there are none for certain: one object for the
            whole life of the queue, so that several of them are asked without a call of each.
    """

    topic: str
    dropped: int = 0
    waits: object = True

    @abc.abstractmethod
    def drain(self) -> list[Any]:
        """Return all messages since the last call, oldest first. Does not block."""

    def take(self, first: Container[str], most: int, others: int) -> list[Any]:
        """Return at most `most` messages of the senders `first`, then at most `others` of all others.

        See `Backlog.take`. This default returns all messages: its senders belong to one user.
        """
        return self.drain()


class Writer(abc.ABC):
    """A topic to write to.

    Attributes:
        topic: Resolved name of the topic.
        carries: Type of its messages, by the middleware's name; empty: no other node can be on this topic.
        is_received: Whether a plugin of the same process receives it, which no other node sees.
    """

    topic: str
    carries: str = ""
    is_received: bool = False

    def prepare(self, message: Message) -> None:  # noqa: B027 most have nothing to do
        """Do ahead what would make the first `write` of such a message slow; sends nothing."""

    @abc.abstractmethod
    def write(self, message: Message) -> None:
        """Send a message; its numbers are copied, so that the caller may reuse it. Does not block."""


class NullReader(Reader):
    """Receives nothing.

    Args:
        topic: Name of the topic.
        message: Its message.
    """

    def __init__(self, topic: str, message: str):
        self.topic = topic
        self.carries = message

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        return NONE

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        return ()

    def read_from(self, publisher: Publisher) -> MessageStatus:
        """See `Reader.read_from`."""
        return NONE

    def age(self) -> float:
        """See `Reader.age`."""
        return math.inf


class NullQueue(Queue):
    """Receives nothing.

    Args:
        topic: Name of the topic.
    """

    def __init__(self, topic: str):
        self.topic = topic

    def drain(self) -> list[Any]:
        """See `Queue.drain`."""
        return []


class NullWriter(Writer):
    """Sends nothing, and does not announce the topic.

    Args:
        topic: Name of the topic.
        message: Its message; empty: it is on no topic.
    """

    def __init__(self, topic: str, message: str = ""):
        self.topic = topic
        self.carries = message

    def write(self, message: Message) -> None:
        """Drop the message; see `Writer.write`."""
