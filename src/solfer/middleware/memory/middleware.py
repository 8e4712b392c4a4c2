"""The Middleware of a node on a Bus."""

from collections import deque
from collections.abc import Callable, Container, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import fields
from typing import Any

from solfer.errors import MiddlewareError, ServiceUnavailable, SolferError, UnknownName, described
from solfer.interfaces.declaration import Service
from solfer.middleware.memory.bus import Bus, SenderState, Topic
from solfer.transport.backlog import Backlog
from solfer.transport.endpoints import NEW, NONE, OLD, JointOrder, MessageStatus, Publisher, Queue, Reader, Writer
from solfer.transport.health import Health
from solfer.transport.messages import Message, copied
from solfer.transport.middleware import HealthReport, Middleware, Submit
from solfer.transport.topics import Topics


class MemoryPublisher(Publisher):
    """A node that publishes on a topic, as one reader knows it.

    Attributes:
        state: What it has published.
        seen: Number of its message that was read last.
    """

    def __init__(self, state: SenderState):
        super().__init__(state.sender)
        self.state = state
        self.seen = 0


class MemoryReader(Reader):
    """The newest message of a topic on a bus, or each of them.

    Args:
        bus: The bus.
        topic: The topic.
        kept: See `Middleware.reader`.
    """

    def __init__(self, bus: Bus, topic: Topic, kept: int = 0):
        self.topic = topic.name
        self._bus = bus
        self._source = topic
        self._seen = 0
        self.carries = topic.type
        self.publishers: list[MemoryPublisher] = []
        self._backlog: Backlog[tuple[Message, float]] = Backlog(kept)
        self._waiting = deque[tuple[Message, float]]()
        if kept:
            for state in sorted(topic.senders.values(), key=lambda state: state.arrival):
                if state.newest is not None:
                    self._backlog.put(state.sender, (state.newest, state.arrival))
            topic.listeners.append(self._put)

    @property
    def dropped(self) -> int:  # type: ignore[override]
        """See `Reader`."""
        return self._backlog.dropped

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        if self._source.sequence == self._seen:
            return OLD if self._seen else NONE
        source = self._source
        self._seen = source.sequence
        self.message = source.newest
        self.arrival = source.arrival
        if len(source.senders) > 1:
            for publisher in self.update():
                publisher.arrival = publisher.state.arrival
        return NEW

    def update(self) -> Sequence[MemoryPublisher]:
        """See `Reader.update`."""
        known = self.publishers
        senders = self._source.senders
        if len(known) < len(senders):
            known.extend(MemoryPublisher(each) for each in list(senders.values())[len(known) :])
        return known

    def read_from(self, publisher: MemoryPublisher) -> MessageStatus:
        """See `Reader.read_from`."""
        state = publisher.state
        if state.sequence == publisher.seen:
            return NONE if self.message is None else OLD
        publisher.seen = state.sequence
        self.message = state.newest
        publisher.arrival = self.arrival = state.arrival
        return NEW

    def read_next(self) -> MemoryPublisher | None:
        """See `Reader.read_next`."""
        waiting = self._waiting
        if not waiting:
            waiting.extend(self._backlog.drain())
        if not waiting:
            return None
        self.message, self.arrival = waiting.popleft()
        publisher = next(each for each in self.update() if each.name == self.message.sender)
        publisher.arrival = self.arrival
        return publisher

    def _put(self, message: Message) -> None:
        self._backlog.put(message.sender, (message, self._source.arrival))

    def age(self) -> float:
        """See `Reader.age`."""
        return self._bus.time - self._source.arrival


class MemoryQueue(Queue):
    """Every message of a topic on a bus."""

    def __init__(self, topic: Topic, size: int):
        self.topic = topic.name
        self._backlog: Backlog[Message] = Backlog(size)
        self.waits = self._backlog.waiting
        topic.listeners.append(self._put)

    def _put(self, message: Message) -> None:
        self._backlog.put(message.sender, message)

    @property
    def dropped(self) -> int:
        """See `Queue.dropped`."""
        return self._backlog.dropped

    def drain(self) -> list[Message]:
        """See `Queue.drain`."""
        return self._backlog.drain()

    def take(self, first: Container[str], most: int, others: int) -> list[Message]:
        """See `Queue.take`."""
        return self._backlog.take(first, most, others)


class MemoryWriter(Writer):
    """Writes to a topic on a bus."""

    def __init__(self, bus: Bus, topic: Topic, sender: str):
        self.topic = topic.name
        self._bus = bus
        self._target = topic
        self._sender = sender
        self.carries = topic.type

    def write(self, message: Message) -> None:
        """See `Writer.write`."""
        sent = copied(message)
        sent.sender = self._sender
        self._target.publish(sent, self._sender, self._bus.time)


class MemoryMiddleware(Middleware):
    """A node on a bus.

    Args:
        bus: What the nodes share.
        name: Name of the node; it is the sender of what it writes.
    """

    def __init__(self, bus: Bus, name: str = "node"):
        self.bus = bus
        self.name = name
        self._offered = list[str]()

    def now(self) -> float:
        """See `Middleware.now`."""
        return self.bus.time

    def sleep_until(self, deadline: float) -> None:
        """Let the other nodes on the bus work until `deadline`."""
        self.bus.run_until(deadline)

    @property
    def rewinds(self) -> int:
        """See `Middleware.rewinds`."""
        return self.bus.rewinds

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`."""
        self.bus.publish_time(simulated)

    def running(self) -> bool:
        """See `Middleware.running`."""
        return not self.bus.ended

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`."""
        known = {key.lstrip("/"): value for key, value in self.bus.parameters.items()}
        if name.lstrip("/") not in known:
            raise UnknownName("parameter", name, self.bus.parameters, where=where)
        return known[name.lstrip("/")]

    def reader(self, topic: str, message: str, kept: int = 0) -> Reader:
        """See `Middleware.reader`."""
        return MemoryReader(self.bus, self._on(topic, message, 1), kept)

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Queue:
        """See `Middleware.queue`; no message has bytes here."""
        return MemoryQueue(self._on(topic, message, 1), size)

    def writer(self, topic: str, message: str) -> Writer:
        """See `Middleware.writer`."""
        return MemoryWriter(self.bus, self._on(topic, message, 0), self.name)

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`; time passes until the first message."""
        source = self.bus.topic(topic, message)
        order = JointOrder(MemoryReader(self.bus, source, 0))
        self._wait(order.read, timeout)
        return source.name, tuple(order.names) or None

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`; time passes until the reply is there."""
        answer = self.request(name, interface, request, reply=reply, timeout=timeout)
        self._wait(answer.done, timeout)
        if not answer.done():
            raise MiddlewareError(
                f"service '{name}' did not answer within {timeout:g} s",
                expected="an owner that runs; one that is held up does not answer",
            )
        try:
            return answer.result()
        except ServiceUnavailable:
            raise
        except SolferError as error:
            raise MiddlewareError(f"service '{name}' refuses: {described(error, lines=True)}") from error

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`."""
        try:
            return self.bus.call(name, request if fields(request) else None)
        except UnknownName as error:
            answer: Future[Any] = Future()
            answer.set_exception(ServiceUnavailable(f"no node offers the service '{name}'", names=error.names))
            return answer

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`."""
        for service in services:
            self.bus.offer(f"{owner}/{service.name}", service, submit)
            self._offered.append(f"{owner}/{service.name}")

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`; the answer is there at once."""
        answer: Future[Topics] = Future()
        answer.set_result(self.bus.topics(self))
        return answer

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""
        self.bus.reports[name] = HealthReport(level, summary, dict(values))

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        return self.bus.reports

    def close(self) -> None:
        """See `Middleware.close`; nothing is queued here, but others see that the node is gone."""
        self.bus.withdraw(self, self._offered)
        self._offered.clear()

    def _on(self, name: str, message: str, end: int) -> Topic:
        """Return a topic, with this node registered at one of its ends."""
        topic = self.bus.topic(name, message)
        topic.ends[end].append(self)
        return topic

    def _wait(self, done: Callable[[], bool], timeout: float) -> None:
        end = self.bus.time + timeout
        while not done() and self.bus.time < end:
            self.bus.run_until(self.bus.time + 1e-3)
