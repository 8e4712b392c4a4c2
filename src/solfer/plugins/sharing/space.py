"""The shared space: what one component publishes is there for the next in the same cycle, without leaving the process.

It is a directory of publications: those of pipes are known before any pipe is made, those that components declare as
soon as the component is there, so that components behind it in the list find them. Messages go out through the
middleware as well, so that everybody else receives what they would without a shared plugin.
"""

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import PipeError, raise_all
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus, Publisher, Reader, Writer
from solfer.transport.messages import Message, arrays, copied


@dataclass(frozen=True)
class SharedTopic:
    """A topic that a component of the shared plugin publishes.

    Attributes:
        component: Name of its plugin.
        topic: Resolved name of the topic.
        message: Canonical name of the message.
        where: Where the configuration names the topic.
    """

    component: str
    topic: str
    message: str
    where: str = ""


class SpaceChannel:
    """The newest message of a publication, in memory of its own.

    Args:
        publication: What is published.

    Attributes:
        publication: See above.
        message: The newest message; before the first one that its writer has prepared, None without one.
        sequence: Number of messages so far.
        arrival: Time of the newest message [s]; minus infinity before the first.
        is_received: Whether another component receives it.
    """

    def __init__(self, publication: SharedTopic):
        self.publication = publication
        self.is_received = False
        self.message: Message | None = None
        self.sequence = 0
        self.arrival = -math.inf
        self._original: Message | None = None
        self._arrays: tuple[tuple[np.ndarray, np.ndarray], ...] = ()

    def prepare(self, message: Message) -> None:
        """Make the memory for a message that is written again and again with other numbers."""
        self._original, self.message = message, copied(message)
        self._arrays = tuple(zip(arrays(message), arrays(self.message), strict=True))
        self.message.sender = self.publication.component

    def put(self, message: Message, now: float) -> None:
        """Publish a message at a time [s]; its numbers are copied."""
        if message is not self._original:
            self.prepare(message)
        for source, target in self._arrays:
            target[...] = source
        self.message.stamp = message.stamp
        self.sequence += 1
        self.arrival = now


class SharedSpace:
    """The publications of a shared plugin.

    Args:
        publications: Those that are known from the start.

    Attributes:
        channels: One for each publication, by topic and message.

    Raises:
        PipeError: Two components publish one topic; SolferErrors: this happens several times.
    """

    def __init__(self, publications: Iterable[SharedTopic]):
        self.channels: dict[tuple[str, str], SpaceChannel] = {}
        self._first: dict[str, SharedTopic] = {}
        errors = []
        for each in publications:
            try:
                self.add(each)
            except PipeError as error:
                errors.append(error)
        raise_all(errors)

    def add(self, publication: SharedTopic) -> None:
        """Add a publication.

        Raises:
            PipeError: Another component publishes its topic.
        """
        self.channels.setdefault((publication.topic, publication.message), SpaceChannel(publication))
        other = self._first.setdefault(publication.topic, publication)
        if other.component != publication.component:
            raise _rivals(other, publication)

    def published_to(self, component: str, topic: str, message: str) -> SpaceChannel | None:
        """Return the channel that a component subscribes with a topic and a message; None: no other publishes it."""
        channel = self.channels.get((topic, message))
        return None if channel is None or channel.publication.component == component else channel

    def published_by(self, component: str, topic: str, message: str) -> SpaceChannel | None:
        """Return the channel that a component publishes; None: others do not know this publication."""
        channel = self.channels.get((topic, message))
        return None if channel is None or channel.publication.component != component else channel


class SpaceWriter(Writer):
    """Publishes in the shared space and through the middleware.

    Args:
        outside: Publishes through the middleware.
        channel: That of the topic.
        now: The clock [s].

    Attributes:
        channel: See above.
    """

    def __init__(self, outside: Writer, channel: SpaceChannel, now: Callable[[], float]):
        self.topic = outside.topic
        self.carries = outside.carries
        self.channel = channel
        self._outside = outside
        self._now = now

    @property
    def is_received(self) -> bool:  # type: ignore[override]
        """See `Writer.received`."""
        return self.channel.is_received

    def prepare(self, message: Message) -> None:
        """See `Writer.prepare`."""
        self.channel.prepare(message)
        self._outside.prepare(message)

    def write(self, message: Message) -> None:
        """See `Writer.write`; the others of the shared plugin have the message first."""
        self.channel.put(message, self._now())
        self._outside.write(message)


class SpaceReader(Reader):
    """The newest message of a component of the same shared plugin. No other node can be on its topic.

    Args:
        topic: Resolved name of the topic.
        channel: That of the topic.
        now: The clock [s].

    Attributes:
        channel: See above.
    """

    def __init__(self, topic: str, channel: SpaceChannel, now: Callable[[], float]):
        self.topic = topic
        self.channel = channel
        self._now = now
        self._seen = 0
        self._publisher = Publisher(channel.publication.component)

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        return self.read_from(self._publisher)

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        if not self.publishers and self.channel.sequence:
            self.publishers = (self._publisher,)
        return self.publishers

    def read_from(self, publisher: Publisher) -> MessageStatus:
        """See `Reader.read_from`."""
        channel = self.channel
        if channel.sequence == self._seen:
            return OLD if self._seen else NONE
        self._seen = channel.sequence
        self.message = channel.message
        publisher.arrival = self.arrival = channel.arrival
        return NEW

    def age(self) -> float:
        """See `Reader.age`."""
        return self._now() - self.channel.arrival


class OthersReader(Reader):
    """A topic without the messages of one sender: a component does not receive what it publishes itself.

    Args:
        outside: Receives all of them.
        senders: Names of the sender that is left out.
    """

    def __init__(self, outside: Reader, senders: Collection[str]):
        self.topic = outside.topic
        self.carries = outside.carries
        self._outside = outside
        self._senders = frozenset(senders)
        self._known = 0
        self._newest = -math.inf

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        status: MessageStatus = NONE if self.message is None else OLD
        for publisher in self.update():
            if self._outside.read_from(publisher) is NEW and publisher.arrival >= self._newest:
                self._keep(publisher)
                status = NEW
        return status

    def update(self) -> Sequence[Publisher]:
        """See `Reader.update`."""
        publishers = self._outside.update()
        if len(publishers) != self._known:
            self._known = len(publishers)
            self.publishers = tuple(each for each in publishers if each.name not in self._senders)
        return self.publishers

    def read_from(self, publisher: Publisher) -> MessageStatus:
        """See `Reader.read_from`."""
        status = self._outside.read_from(publisher)
        if status is NEW:
            self._keep(publisher)
        return status

    def read_next(self) -> Publisher | None:
        """See `Reader.read_next`."""
        self.update()
        while (publisher := self._outside.read_next()) is not None:
            if publisher.name not in self._senders:
                self._keep(publisher)
                break
        self.dropped = self._outside.dropped
        return publisher

    def age(self) -> float:
        """See `Reader.age`."""
        return math.inf if self.message is None else self._outside.age()

    def awaited(self) -> list[str]:
        """See `Reader.awaited`."""
        return [name for name in self._outside.awaited() if name not in self._senders]

    def _keep(self, publisher: Publisher) -> None:
        self.message = self._outside.message
        self._newest = self.arrival = publisher.arrival
        self.refused = self._outside.refused


def _rivals(first: SharedTopic, second: SharedTopic) -> PipeError:
    return PipeError(
        f"'{first.component}' ({first.where}) and '{second.component}' both publish the topic '{second.topic}'",
        where=second.where,
        expected="a topic for each of them",
    )
