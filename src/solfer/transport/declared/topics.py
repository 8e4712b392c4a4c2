"""Topics that components declare."""

import logging
import math

from solfer.errors import ComponentError, SolferError
from solfer.interfaces.declaration import TopicIn, TopicOut, full_name
from solfer.throttle import Throttle
from solfer.transport.clocks.stamp_faults import StreamClock
from solfer.transport.declared.fields import encoder, require_carried, value_of
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)


class SoleSender:
    """Admits one sender of a stream at a time: the first, until it is silent."""

    TIMEOUT = 0.5
    """Time without a message after which another sender counts [s]."""

    def __init__(self) -> None:
        self.name = ""
        self._newest = -math.inf

    def admits(self, sender: str, now: float) -> bool:
        """Decide whether a message that is received `now` [s] counts."""
        if sender != self.name and now - self._newest <= self.TIMEOUT:
            return False
        self.name = sender
        self._newest = now
        return True


class DeclaredIn:
    """Hands the messages of a topic to a component.

    Args:
        owner: Name of the component.
        topic: The declaration.
        middleware: Carries it.
        sole: Sender of its stream; None: every sender counts.

    Attributes:
        queue: Where the messages wait.

    Raises:
        SolferError: The topic carries another message, or the dataclass does not fit the interface.
    """

    def __init__(self, owner: str, topic: TopicIn, middleware: Middleware, sole: SoleSender | None = None):
        require_carried(topic.interface)
        middleware.require_fields(topic.interface, topic.message)
        self._topic = topic
        self._sole = sole
        self._throttle = Throttle(logger)
        self._now = middleware.now
        self._clocks: dict[str, StreamClock] = {}
        self.queue = middleware.declared_queue(full_name(owner, topic.name), topic.interface)

    def receive(self, refusal: str) -> None:
        """Hand over what has come; while the component does not work it is dropped."""
        messages = self.queue.drain()
        if refusal:
            self._clocks.clear()
            return
        if not messages:
            return
        now = self._now()
        sole = self._sole
        for message in messages:
            if sole is not None and not sole.admits(message.sender, now):
                self._throttle.warning(
                    message.sender,
                    "topic %s: messages of %s are ignored while %s sends",
                    self.queue.topic,
                    message.sender,
                    sole.name,
                )
                continue
            try:
                value = value_of(self._topic.message, message)
                if self._topic.ordered:
                    self._check_stamp(value.header.stamp, message.sender, now)
                self._topic.handler(value)
            except SolferError as error:
                self._throttle.warning(
                    message.sender, "topic %s: a message of %s is refused: %s", self.queue.topic, message.sender, error
                )

    def _check_stamp(self, stamp: float, sender: str, arrival: float) -> None:
        clock = self._clocks.get(sender)
        if clock is None:
            if len(self._clocks) == 32:  # senders whose name changes each time do not fill the memory
                self._clocks.clear()
            clock = self._clocks[sender] = StreamClock()
        if not clock.accepts(stamp, arrival):
            raise ComponentError(
                f"a stamp of {stamp:.3f} s after one of {clock.newest:.3f} s", expected="times that do not go back"
            )


class DeclaredOut:
    """Publishes the messages of a component.

    Args:
        owner: Name of the component.
        topic: The declaration.
        middleware: Carries it.

    Raises:
        SolferError: The topic carries another message, or the dataclass does not fit the interface.
    """

    def __init__(self, owner: str, topic: TopicOut, middleware: Middleware):
        require_carried(topic.interface)
        middleware.require_fields(topic.interface, topic.message)
        self._topic = topic
        self._encode = encoder(topic.interface, topic.message)
        self._writer = middleware.declared_writer(full_name(owner, topic.name), topic.interface)
        self._now = middleware.now
        self._has_worked = False
        self._next = -math.inf

    def publish(self) -> None:
        """Publish what the component has.

        Raises:
            ComponentError: It has something else than its declaration says.
        """
        value = self._topic.collect()
        if value is None:
            return
        if not isinstance(value, self._topic.message):
            raise ComponentError(
                f"a {type(value).__name__} for topic {self._writer.topic}", expected=f"a {self._topic.message.__name__}"
            )
        self._has_worked = True
        self._writer.write(self._encode(value))

    def rest(self, refusal: str) -> None:
        """Publish now and then, while a component that has worked does not (a `refusal`), what is declared for that."""
        if refusal and self._has_worked and self._now() >= self._next:
            self._next = self._now() + 0.05  # repeated: a message may be lost
            self._writer.write(self._encode(self._topic.rest))
