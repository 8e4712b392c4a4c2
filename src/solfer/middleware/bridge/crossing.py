"""A topic that is handed on from one middleware to another."""

import logging

from solfer.errors import SolferError
from solfer.logs import Throttle
from solfer.middleware.bridge.routes import Route
from solfer.pipes.middleware import Middleware

logger = logging.getLogger(__name__)


class Crossing:
    """One topic in one direction: of what has come since the last turn only the newest message goes on.

    Args:
        route: The topic.
        source: Where it is heard.
        target: Where it is told.

    Attributes:
        topic: Name of the topic.
        passed: Messages that went on.
        dropped: Messages that newer ones replaced.
        refused: Messages that the target did not take.
    """

    def __init__(self, route: Route, source: Middleware, target: Middleware):
        self.topic, self.passed, self.refused, self._skipped = route.topic, 0, 0, 0
        self._queue = source.queue(route.topic, route.message)
        self._writer = target.writer(route.topic, route.message)
        self._throttle = Throttle(logger)

    @property
    def dropped(self) -> int:
        """See the class."""
        return self._skipped + self._queue.dropped

    def run(self) -> None:
        """Hand on what is new. A message that is refused is named once a second, and the next one is tried."""
        messages = self._queue.drain()
        if not messages:
            return
        self._skipped += len(messages) - 1
        try:
            self._writer.write(messages[-1])
        except SolferError as error:
            self.refused += 1
            self._throttle.warning("refused", "topic %s is not handed on: %s", self.topic, error)
        else:
            self.passed += 1
