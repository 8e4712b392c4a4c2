"""Topics, services, parameters and a virtual clock that several nodes of one process share."""

import heapq
import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from solfer.errors import MiddlewareError, SolferError, UnknownName, described, raise_all
from solfer.interfaces.declaration import Service
from solfer.middleware.memory.faults import TIME_TOLERANCE, FaultsRecord, Line, Stalls, TopicFaultsRecord, fits
from solfer.transport.messages import Message
from solfer.transport.middleware import HealthReport, Submit
from solfer.transport.topics import Topics


class SenderState:
    """What one node has published on a topic.

    Args:
        sender: Its name.

    Attributes:
        sender: Its name.
        newest: The newest message, None before the first.
        arrival: Time of the newest message [s].
        sequence: Number of messages so far.
    """

    def __init__(self, sender: str):
        self.sender = sender
        self.arrival = -math.inf
        self.sequence = 0
        self.newest: Message | None = None


class Topic:
    """What was published on a topic.

    Attributes:
        name: Name of the topic.
        type: Canonical name of the message that it carries.
        newest: The newest message, None before the first.
        arrival: Time of the newest message [s].
        sequence: Number of messages so far.
        senders: The state of each node that has published, by its name, the first one first.
        listeners: Called with each message.
        ends: Nodes that can publish, and nodes that subscribe, `MemoryMiddleware`s of this bus.
    """

    def __init__(self, name: str, message_type: str):
        self.name = name
        self.type = message_type
        self.newest: Message | None = None
        self.arrival = -math.inf
        self.sequence = 0
        self.senders: dict[str, SenderState] = {}
        self.listeners: list[Callable[[Message], None]] = []
        self.ends: tuple[list[object], list[object]] = ([], [])

    def publish(self, message: Message, sender: str, now: float) -> None:
        """Publish a message of a node at a time [s]."""
        state = self.senders.get(sender)
        if state is None:
            state = self.senders[sender] = SenderState(sender)
        self.newest = state.newest = message
        self.arrival = state.arrival = now
        self.sequence += 1
        state.sequence += 1
        for listener in self.listeners:
            listener(message)


class FaultyTopic(Topic):
    """A topic whose messages arrive late, or never.

    Args:
        name: Name of the topic.
        message_type: Canonical name of the message that it carries.
        bus: Delivers the messages.
        faults: What happens to them.

    Attributes:
        lost: Messages that never arrive, so far.
    """

    def __init__(self, name: str, message_type: str, bus: "Bus", faults: TopicFaultsRecord):
        super().__init__(name, message_type)
        self.lost = 0
        self._clock = faults.clock
        self._bus = bus
        self._line = Line(faults, bus.faults.draws(f"topic {name.lstrip('/')}"))

    def publish(self, message: Message, sender: str, now: float) -> None:
        """See `Topic.publish`; it is there when it has arrived."""
        message.stamp += self._clock
        due = self._line.due(now)
        if due is None:
            self.lost += 1
        elif due <= now:
            super().publish(message, sender, now)
        else:
            self._bus.deliver(due, partial(super().publish, message, sender))


@dataclass(frozen=True, order=True)
class _Delivery:
    """A message in transit."""

    due: float
    order: int
    arrive: Callable[[float], None] = field(compare=False)


@dataclass(order=True)
class _Entry:
    """Repeated work; times are multiples of the period, so that they do not drift.

    They are whole nanoseconds: what is due at one time by two periods comes in the order of its registration.
    """

    due: float
    order: int
    work: Callable[[], None] = field(compare=False)
    period: float = field(compare=False)
    start: float = field(compare=False)
    count: int = field(compare=False, default=0)


class Bus:
    """What the nodes of the memory middleware share.

    Work that is due at some time is scheduled with `every`; `run_until` does it in the order of its time, and of its
    registration where times are equal. The same work gives the same results to the last bit.

    Args:
        parameters: Values that nodes can request, by name, such as '/robot_description'.
        faults: What goes wrong on its topics and in its loops; None: nothing.

    Attributes:
        time: Virtual time [s].
        faults: See above.
        reports: The newest health report of each part.
        rewinds: How often the time that a simulation published has gone back.
    """

    def __init__(self, parameters: Mapping[str, Any] | None = None, faults: FaultsRecord | None = None):
        self.time = 0.0
        self.faults = faults or FaultsRecord()
        self.parameters = dict(parameters or {})
        self.reports: dict[str, HealthReport] = {}
        self.ended = False
        self.rewinds = 0
        self._published = -math.inf
        self._topics: dict[str, Topic] = {}
        self._services: dict[str, tuple[Service, Submit]] = {}
        self._agenda: list[_Entry] = []
        self._deliveries: list[_Delivery] = []
        self._loops = itertools.count()
        self._order = itertools.count()

    def topic(self, name: str, message_type: str) -> Topic:
        """Return the topic of that name; made at first use.

        Raises:
            MiddlewareError: The topic carries another message.
        """
        topic = self._topics.get(name.lstrip("/"))
        if topic is None:
            faults = self.faults.of_topic(name)
            topic = (
                Topic(name, message_type) if faults is None else FaultyTopic(name, message_type, self, faults=faults)
            )
            self._topics[name.lstrip("/")] = topic
        if topic.type != message_type:
            raise MiddlewareError(f"topic '{name}' carries {topic.type}", expected=message_type)
        return topic

    def check_faults(self) -> None:
        """Check that there is a topic for each of the faults, once all nodes are made.

        Raises:
            UnknownName: There is none. SolferErrors: There is none for several of them.
        """
        unused = (each for each in self.faults.topics if not any(fits(each, topic) for topic in self._topics))
        raise_all(
            [UnknownName("topic", each, self._topics, where=self.faults.where("topics", each)) for each in unused]
        )

    def topics(self, node: object) -> Topics:
        """Return the topics that other nodes than `node` publish and receive."""
        published, received = (
            {
                name: topic.type
                for name, topic in self._topics.items()
                if any(each is not node for each in topic.ends[end])
            }
            for end in (0, 1)
        )
        return Topics(published, received)

    def publish_time(self, simulated: float) -> None:
        """Set the time of a simulation [s]; no clock follows it here, but `rewinds` counts when it goes back."""
        self.rewinds += simulated < self._published
        self._published = simulated

    def offer(self, name: str, service: Service, submit: Submit) -> None:
        """Offer a service under its full name.

        Raises:
            MiddlewareError: The name is taken.
        """
        if name in self._services:
            raise MiddlewareError(f"service '{name}' is offered twice", expected="a name of its own for each service")
        self._services[name] = (service, submit)

    def withdraw(self, node: object, services: Iterable[str]) -> None:
        """Forget what a node that has closed offered, published and received; what it has published stays read.

        Args:
            node: The node.
            services: Full names of its services.
        """
        for name in services:
            self._services.pop(name, None)
        for topic in self._topics.values():
            for end in topic.ends:
                end[:] = [each for each in end if each is not node]

    def call(self, name: str, request: Any = None, **fields: Any) -> "Future[Any]":
        """Call a service; the reply is there after the next cycle of the node that offers it.

        Args:
            name: Full name, such as 'joint_states/trajectory'.
            request: The request; without one it is made of `fields`.
            **fields: Fields of the request.

        Raises:
            UnknownName: No node offers that service.
        """
        if name not in self._services:
            raise UnknownName("service", name, self._services)
        service, submit = self._services[name]
        sent = service.request(**fields) if request is None else request

        def refusal(error: SolferError) -> Any:
            return service.reply(success=False, message=described(error, lines=True))

        try:
            work = service.prepared(sent)
        except SolferError as error:
            refused: Future[Any] = Future()
            refused.set_result(refusal(error))
            return refused

        def answer() -> Any:
            try:
                return work()
            except SolferError as error:
                return refusal(error)

        return submit(answer)

    def every(self, period: float, work: Callable[[], None], start: float | None = None, cycles: bool = False) -> None:
        """Schedule `work` at `start` (default: now) and then once each `period` [s].

        Args:
            period: See above.
            work: See above.
            start: See above.
            cycles: Whether these are the cycles of a loop, of which `faults` leave out some.
        """
        first = self.time if start is None else start
        if cycles and (self.faults.loop.skip or self.faults.loop.stalls):
            work = self._disturbed(work, period)
        heapq.heappush(self._agenda, _Entry(round(first, 9), next(self._order), work, period=period, start=first))

    def run_until(self, end: float) -> None:
        """Do all work that is due before `end` [s], then set the clock to it."""
        while self._agenda and self._agenda[0].due < end - 1e-10 and not self.ended:
            if self._deliveries:
                self._arrive(self._agenda[0].due)
            entry = heapq.heappop(self._agenda)
            self.time = max(self.time, entry.due)
            entry.count += 1
            entry.due = round(entry.start + entry.count * entry.period, 9)
            heapq.heappush(self._agenda, entry)
            entry.work()
        if self._deliveries:
            self._arrive(end)
        self.time = max(self.time, end)

    def deliver(self, due: float, arrive: Callable[[float], None]) -> None:
        """Call `arrive` with the time at `due` [s]: before the work of that time, and in the order of these calls."""
        heapq.heappush(self._deliveries, _Delivery(due, next(self._order), arrive))

    def _arrive(self, end: float) -> None:
        """Deliver what is due at `end` [s] or before."""
        deliveries = self._deliveries
        while deliveries and deliveries[0].due <= end + TIME_TOLERANCE and not self.ended:
            delivery = heapq.heappop(deliveries)
            self.time = max(self.time, min(delivery.due, end))
            delivery.arrive(self.time)

    def _disturbed(self, work: Callable[[], None], period: float) -> Callable[[], None]:
        """Return the `work` of a loop of which cycles are left out, drawn for each loop by itself."""
        stalls = Stalls(self.faults.loop, self.faults.draws(f"loop {next(self._loops)}"), period)

        def cycle() -> None:
            if not stalls.leaves_out(self.time):
                work()

        return cycle
