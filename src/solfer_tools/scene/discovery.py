"""Topics that are known by what they carry: which plugins run is found out as they come and go."""

import logging
import math
from collections.abc import Mapping
from concurrent.futures import Future

from solfer.errors import MiddlewareError
from solfer.throttle import Throttle
from solfer.transport import Middleware, Reader
from solfer.transport.topics import Topics

STALE_AGE = 0.5
"""Age from which on a message does not count [s]."""

logger = logging.getLogger(__name__)


class TopicRequests:
    """Requests the topics of all other nodes once a second.

    Args:
        middleware: Knows them.
    """

    def __init__(self, middleware: Middleware):
        self._middleware = middleware
        self._pending: Future[Topics] | None = None
        self._next = -math.inf

    def answer(self) -> Topics | None:
        """Return an answer that is new; None: there is none.

        Raises:
            MiddlewareError: The topics cannot be found out; they are requested again.
        """
        now = self._middleware.now()
        if self._pending is None and now >= self._next:
            self._pending = self._middleware.topics()
            self._next = now + 1.0  # [s]
        if self._pending is None or not self._pending.done():
            return None
        pending = self._pending
        self._pending = None
        return pending.result()


class DiscoveredTopics:
    """Readers of topics `<owner>/<name>` in the namespace of this node.

    Args:
        middleware: Carries them.
        messages: What topics carry, by the last part of their names.
    """

    def __init__(self, middleware: Middleware, messages: Mapping[str, str]):
        self._middleware = middleware
        self._messages = messages
        self._space = middleware.resolve("x")[:-1]
        self._readers: dict[str, dict[str, Reader]] = {name: {} for name in messages}
        self._requests = TopicRequests(middleware)
        self._throttle = Throttle(logger, 5.0)

    def update(self) -> None:
        """Request topics now and then, and subscribe what is new."""
        try:
            topics = self._requests.answer()
        except MiddlewareError as error:
            self._throttle.warning("topics", "topics are not known: %s", error.line)
            return
        for topic, carries in topics.published.items() if topics is not None else ():
            owner, _, name = topic.removeprefix(self._space).rpartition("/")
            if not topic.startswith(self._space) or not owner or "/" in owner:
                continue
            readers = self._readers.get(name, {})
            if name in self._messages and self._messages[name] == carries and owner not in readers:
                readers[owner] = self._middleware.reader(topic, carries)

    def newest(self, name: str) -> dict[str, Reader]:
        """Return the readers of topics `<owner>/<name>` with a message that counts, by their owners."""
        for reader in self._readers[name].values():
            reader.read()
        return {owner: reader for owner, reader in self._readers[name].items() if reader.age() <= STALE_AGE}
