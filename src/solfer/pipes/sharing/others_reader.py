"""A topic that a component both publishes and receives."""

import math
from collections.abc import Collection, Sequence

from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus, Publisher, Reader


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
