"""A topic between plugins of one process: what one publishes is there for the others in the same cycle."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from solfer.pipes.feedback_pipe import FeedbackPipe
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus, Publisher, Reader, Writer
from solfer.transport.messages import Message


class LocalTopic:
    """The newest message of one plugin; of those of a shared Robot, which have their numbers there already, the number.

    Args:
        component: Name of the plugin.

    Attributes:
        component: See above.
        message: The newest message; None where only its numbers count, which are in a shared Robot.
        sequence: Number of messages so far.
        arrival: Time of the newest message [s]; minus infinity before the first.
        is_received: Whether another plugin receives it.
        original: The message that was written last, whose numbers are copied; None before the first.
        copies: Its arrays, each with that of `message` to which its numbers go.
    """

    original: Message | None = None
    copies: tuple[tuple[np.ndarray, np.ndarray], ...] = ()

    def __init__(self, component: str):
        self.component = component
        self.message: Message | None = None
        self.sequence = 0
        self.arrival = -math.inf
        self.is_received = False

    def prepare(self, message: Message) -> None:
        """See `Writer.prepare`."""
        self.original = message


class LocalWriter(Writer):
    """Publishes for plugins of the same process, and through the middleware for all others.

    Args:
        outside: Publishes through the middleware.
        channel: That of the topic.
        now: The clock [s].

    Attributes:
        channel: See above.
    """

    def __init__(self, outside: Writer, channel: LocalTopic, now: Callable[[], float]):
        self.topic = outside.topic
        self.carries = outside.carries
        self.channel = channel
        self._outside = outside
        self._now = now

    @property
    def is_received(self) -> bool:  # type: ignore[override]
        """See `Writer.is_received`."""
        return self.channel.is_received or self._outside.is_received

    def prepare(self, message: Message) -> None:
        """See `Writer.prepare`."""
        self.channel.prepare(message)
        self._outside.prepare(message)

    def write(self, message: Message) -> None:
        """See `Writer.write`; plugins of the same process have the message first."""
        channel = self.channel
        if message is not channel.original:
            channel.prepare(message)
        for source, target in channel.copies:
            target[...] = source
        if channel.message is not None:
            channel.message.__dict__["stamp"] = message.stamp  # to assign one, a message looks for its arrays
        channel.sequence += 1
        channel.arrival = self._now()
        self._outside.write(message)


class LocalReader(Reader):
    """Receives what a plugin of the same process publishes. No other node can be on its topic.

    Args:
        topic: Resolved name of the topic.
        channel: That of the topic.
        now: The clock [s].

    Attributes:
        channel: See above.
    """

    def __init__(self, topic: str, channel: LocalTopic, now: Callable[[], float]):
        self.topic = topic
        self.channel = channel
        channel.is_received = True
        self._now = now
        self._seen = 0
        self._publisher = Publisher(channel.component)

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        channel = self.channel
        if channel.sequence == self._seen:
            return OLD if self._seen else NONE
        self._seen = channel.sequence
        self.message = channel.message
        self._publisher.arrival = self.arrival = channel.arrival
        return NEW

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        if not self.publishers and self.channel.sequence:
            self.publishers = (self._publisher,)
        return self.publishers

    def read_from(self, publisher: Publisher) -> MessageStatus:
        """See `Reader.read_from`; there is one publisher."""
        return self.read()

    def age(self) -> float:
        """See `Reader.age`."""
        return self._now() - self.channel.arrival


class LocalFeedbackPipe(FeedbackPipe):
    """A feedback that counts as read: another plugin has written its values into the Robot that both share."""

    def _decode(self, message: Message) -> None:
        """Do nothing: the values are there."""
