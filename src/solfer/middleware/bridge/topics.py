"""A topic that is forwarded from one middleware to another."""

import logging

from solfer.errors import SolferError
from solfer.middleware.bridge.routes import Route
from solfer.throttle import Throttle
from solfer.transport.messages import TYPES, FieldsMessage, Message
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)


class ForwardedTopic:
    """One topic in one direction: of what has come since the last cycle only the newest message goes on.

    Of a topic that a component declares every message goes on: it may be a goal or a result.

    Args:
        route: The topic.
        source: Where it is received.
        target: Where it is published.

    Attributes:
        topic: Name of the topic.
        passed: Messages that went on.
        dropped: Messages that newer ones replaced.
        refused: Messages that the target refused.
    """

    def __init__(self, route: Route, source: Middleware, target: Middleware):
        self.topic = route.topic
        self.passed = 0
        self.refused = 0
        self._skipped = 0
        self._queue = source.queue(route.topic, route.message)
        self._writer = target.writer(route.topic, route.message)
        self._each = TYPES.get(route.message, FieldsMessage) is FieldsMessage
        self._throttle = Throttle(logger)

    @property
    def dropped(self) -> int:
        """Messages that newer ones replaced."""
        return self._skipped + self._queue.dropped

    def run(self) -> None:
        """Forward what is new. Refused messages are logged once a second, and the next one is tried."""
        messages = self._queue.drain()
        if not messages:
            return
        if self._each:
            for message in messages:
                self._forward(message)
        else:
            self._skipped += len(messages) - 1
            self._forward(messages[-1])

    def _forward(self, message: Message) -> None:
        try:
            self._writer.write(message)
        except SolferError as error:
            self.refused += 1
            self._throttle.warning("refused", "topic %s is not forwarded: %s", self.topic, error)
        else:
            self.passed += 1
