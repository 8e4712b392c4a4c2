"""The shared space: what one component publishes is there for the next in the same cycle, without leaving the process.

It is a directory of publications: those of pipes are known before any pipe is made, those that components declare as
soon as the component is there, so that components behind it in the list find them. Messages go out through the
middleware as well, so that everybody else receives what they would without a shared plugin.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from solfer.errors import PipeError, raise_all
from solfer.pipes.sharing.local_topic import LocalTopic
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


class SpaceChannel(LocalTopic):
    """The newest message of a publication, in memory of its own; before the first one that its writer has prepared.

    Args:
        publication: What is published.

    Attributes:
        publication: See above.
    """

    def __init__(self, publication: SharedTopic):
        super().__init__(publication.component)
        self.publication = publication

    def prepare(self, message: Message) -> None:
        """Make the memory for a message that is written again and again with other numbers."""
        super().prepare(message)
        self.message = copied(message)
        self.copies = tuple(zip(arrays(message), arrays(self.message), strict=True))
        self.message.sender = self.component


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


def _rivals(first: SharedTopic, second: SharedTopic) -> PipeError:
    return PipeError(
        f"'{first.component}' ({first.where}) and '{second.component}' both publish the topic '{second.topic}'",
        where=second.where,
        expected="a topic for each of them",
    )
