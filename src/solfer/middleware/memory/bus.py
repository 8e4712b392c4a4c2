"""Topics, services, parameters and a virtual clock that several nodes of one process share."""

import heapq
import itertools
import math
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from solfer.components.declaration import Service
from solfer.errors import MiddlewareError, SolferError, UnknownName
from solfer.pipes.messages import Message
from solfer.pipes.middleware import Report, Submit


class Topic:
    """What was said on a topic.

    Attributes:
        name: Name of the topic.
        type: Canonical name of the message that it carries.
        newest: The newest message, None before the first.
        arrival: Time of the newest message [s].
        sequence: Number of messages so far.
        senders: Who spoke on it, and when last [s].
        listeners: Called with each message.
    """

    def __init__(self, name: str, message_type: str):
        self.name, self.type = name, message_type
        self.newest: Message | None = None
        self.arrival, self.sequence = -math.inf, 0
        self.senders: dict[str, float] = {}
        self.listeners: list[Callable[[Message], None]] = []


@dataclass(order=True)
class _Entry:
    """Repeated work; times are multiples of the period, so that they do not drift."""

    due: float
    order: int
    work: Callable[[], None] = field(compare=False)
    period: float = field(compare=False)
    start: float = field(compare=False)
    count: int = field(compare=False, default=0)


class Bus:
    """The world of the memory middleware.

    Work that is due at some time is put on the bus with `every`; `run_until` carries it out in the order of its time,
    and of its registration where times are equal. The same work gives the same results to the last bit.

    Args:
        parameters: Values that nodes can ask for, by name, such as '/robot_description'.

    Attributes:
        time: Virtual time [s].
        reports: The newest health report of each part.
        rewinds: How often the time that a simulation told has gone back.
    """

    def __init__(self, parameters: Mapping[str, Any] | None = None):
        self.time = 0.0
        self.parameters = dict(parameters or {})
        self.reports: dict[str, Report] = {}
        self.ended, self.rewinds, self._told = False, 0, -math.inf
        self._topics: dict[str, Topic] = {}
        self._services: dict[str, tuple[Service, Submit]] = {}
        self._agenda: list[_Entry] = []
        self._order = itertools.count()

    def topic(self, name: str, message_type: str) -> Topic:
        """The topic of that name; made at first use.

        Raises:
            MiddlewareError: The topic carries another message.
        """
        topic = self._topics.setdefault(name.lstrip("/"), Topic(name, message_type))
        if topic.type != message_type:
            raise MiddlewareError(f"topic '{name}' carries {topic.type}", expected=message_type)
        return topic

    def tell_time(self, simulated: float) -> None:
        """A simulation tells its time [s]; nobody goes by it here, but all know when it goes back."""
        self.rewinds += simulated < self._told
        self._told = simulated

    def offer(self, name: str, service: Service, submit: Submit) -> None:
        """Make a service known under its full name.

        Raises:
            MiddlewareError: The name is taken.
        """
        if name in self._services:
            raise MiddlewareError(f"service '{name}' is offered twice")
        self._services[name] = (service, submit)

    def call(self, name: str, request: Any = None, **fields: Any) -> "Future[Any]":
        """Ask a service; the reply is there after the next cycle of the one who offers it.

        Args:
            name: Full name, such as 'joint_states/trajectory'.
            request: The request; without one it is made of `fields`.

        Raises:
            UnknownName: Nobody offers that service.
        """
        if name not in self._services:
            raise UnknownName("service", name, self._services)
        service, submit = self._services[name]
        asked = service.request(**fields) if request is None else request

        def refusal(error: SolferError) -> Any:
            return service.reply(success=False, message=str(error))

        try:
            work = service.prepared(asked)
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

    def every(self, period: float, work: Callable[[], None], start: float | None = None) -> None:
        """Do `work` at `start` (default: now) and then once each `period` [s]."""
        first = self.time if start is None else start
        heapq.heappush(self._agenda, _Entry(first, next(self._order), work, period, first))

    def run_until(self, end: float) -> None:
        """Do all work that is due before `end` [s], then set the clock to it."""
        while self._agenda and self._agenda[0].due < end - 1e-12 and not self.ended:
            entry = heapq.heappop(self._agenda)
            self.time = max(self.time, entry.due)
            entry.count += 1
            entry.due = entry.start + entry.count * entry.period
            heapq.heappush(self._agenda, entry)
            entry.work()
        self.time = max(self.time, end)
