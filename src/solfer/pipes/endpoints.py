"""Ends of topics: the newest message, every message, and a way to write."""

import abc
import enum
import math
from typing import Any

from solfer.pipes.messages import Message


class Status(enum.IntEnum):
    """What a read brought: nothing ever, what was known already, or something new."""

    NONE = 0
    OLD = 1
    NEW = 2


NONE, OLD, NEW = Status.NONE, Status.OLD, Status.NEW  # found in a fifth of the time, for what runs in every cycle


class Reader(abc.ABC):
    """The newest message of a topic, whoever sent it.

    Attributes:
        topic: Resolved name of the topic.
        message: The newest message, None until the first one; it stays the same until the next `read`.
        arrival: When `message` arrived, in the pipe's own clock [s]; minus infinity before the first.
        refused: Messages that were none of this topic's type, or contradicted themselves.
        senders: Who spoke on the topic, and when last, in the same clock [s].
    """

    topic: str
    message: Any = None
    arrival: float = -math.inf
    refused: int = 0

    def __init__(self) -> None:
        self.senders: dict[str, float] = {}

    @abc.abstractmethod
    def read(self) -> Status:
        """Fetch the newest message into `message`. Does not block."""

    @abc.abstractmethod
    def age(self) -> float:
        """Time since the newest message arrived, in the pipe's own clock [s]; infinity before the first."""

    def speakers(self, since: float) -> list[str]:
        """Who has spoken since a time [s], sorted; all others are forgotten."""
        for sender, heard in list(self.senders.items()):
            if heard < since:
                self.senders.pop(sender, None)
        return sorted(self.senders)


class Queue(abc.ABC):
    """Every message of a topic, in order of arrival; when it is full the oldest is dropped and counted.

    Attributes:
        topic: Resolved name of the topic.
        dropped: Messages that were lost.
    """

    topic: str
    dropped: int = 0

    @abc.abstractmethod
    def drain(self) -> list[Any]:
        """All messages since the last call, oldest first. Does not block."""


class Writer(abc.ABC):
    """A topic to write to.

    Attributes:
        topic: Resolved name of the topic.
    """

    topic: str

    def prepare(self, message: Message) -> None:  # noqa: B027 most have nothing to do
        """Do now what would make the first `write` of such a message slow; sends nothing."""

    @abc.abstractmethod
    def write(self, message: Message) -> None:
        """Send; the numbers are copied, so that the caller may reuse the message. Does not block."""


class Silent(Writer):
    """Sends nothing, and does not show that there is a topic.

    Args:
        topic: Name of the topic.
    """

    def __init__(self, topic: str):
        self.topic = topic

    def write(self, message: Message) -> None:
        """See `Writer.write`; the message goes nowhere."""
