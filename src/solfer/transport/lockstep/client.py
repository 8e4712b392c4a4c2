"""Lock-step: a simulation waits after each step until the nodes that follow it have made the cycles that are due.

Each tick names the messages that the follower has to have received before, and each acknowledgement those that it has
sent. So what a cycle reads depends on simulated time only, however long messages are in progress.
"""

import abc
import logging
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass
from typing import Any

from solfer.errors import ConfigError, MiddlewareError
from solfer.transport.endpoints import Writer
from solfer.transport.lockstep.step_clock import StepClock
from solfer.transport.waiting import ShutdownRequested, wait_for

logger = logging.getLogger(__name__)

TICK = "solfer/Tick"
"""Interface of the service by which a node follows."""

SERVICE = "lockstep/tick"
"""Its name, behind the node's."""

LOCKSTEP_TIMEOUT = 5.0
"""Longest time that an answer, a message or a connection takes in lock-step [s]."""

Endpoint = Any
"""A topic of a node. A `Writer` has a `topic_publisher` with `number()` and `receivers()`, all others have a
`subscription` with `number(sender, before)` and `senders()`."""

Numbers = dict[tuple[str, str], int]
"""Number of the newest message on a topic by a sender."""

NO_NUMBERS: Numbers = {}


@dataclass(frozen=True)
class Tick:
    """Request of the service, see srv/Tick.srv."""

    time: float
    topics: Sequence[str]
    senders: Sequence[str]
    numbers: Sequence[int]
    before: Sequence[int]


@dataclass(frozen=True)
class Ticked:
    """Its reply."""

    next: float
    topics: Sequence[str]
    numbers: Sequence[int]


class LockstepNetwork(abc.ABC):
    """What a node in lock-step needs of its middleware.

    Attributes:
        name: Full name of the node.
    """

    name: str

    @abc.abstractmethod
    def others(self, endpoints: Iterable[Endpoint]) -> list[set[str]]:
        """Return for each endpoint the nodes that write what it reads, or read what it writes."""

    @abc.abstractmethod
    def offer(self, answer: Callable[[Tick], Ticked]) -> Callable[[], None]:
        """Offer the service; returns what withdraws it. An error of `answer` reaches the caller."""

    @abc.abstractmethod
    def connect(self, node: str) -> "LockstepCall | None":
        """Connect to the service of a node; None: it is not there."""


class LockstepCall(abc.ABC):
    """A connection to a node that follows."""

    @abc.abstractmethod
    def __call__(self, tick: Tick) -> Ticked:
        """Call the service.

        Raises:
            MiddlewareError: The node is gone.
        """

    @abc.abstractmethod
    def close(self) -> None:
        """End the connection."""


def follower_names(value: object, resolve: Callable[[str], str], where: str) -> tuple[str, ...]:
    """Return the full names of the nodes that follow, in the order of their cycles: 'upper_body, lower_body'.

    Args:
        value: Of the parameter that names them; empty: there is no lock-step.
        resolve: Makes a full name.
        where: Place of the parameter.

    Raises:
        ConfigError: It is not a list of names, or names a node twice.
    """
    if not isinstance(value, str):
        raise ConfigError(f"not a list of nodes: '{value}'", where=where, expected="NAME, NAME, ...")
    names = tuple(resolve(name.strip()) for name in value.split(",") if name.strip())
    if len(set(names)) < len(names):
        raise ConfigError(f"a node twice in '{value}'", where=where, expected="each node once")
    return names


def is_writer(endpoint: Endpoint) -> bool:
    """Return whether a node writes a topic."""
    return isinstance(endpoint, Writer)


def published_counts(endpoints: Iterable[Endpoint]) -> dict[str, int]:
    """Return the number of the newest message on each topic that a node writes."""
    return {endpoint.topic: endpoint.topic_publisher.number() for endpoint in endpoints if is_writer(endpoint)}


def wait_for_messages(
    endpoints: Iterable[Endpoint], numbers: Numbers, running: Callable[[], bool], before: Numbers = NO_NUMBERS
) -> None:
    """Wait until the endpoints have received the messages of `numbers`, as far as these are on their topics.

    Args:
        endpoints: Topics of a node.
        numbers: The messages.
        running: False as soon as the end was requested.
        before: Those that were sent before the node was there.

    Raises:
        MiddlewareError: One does not arrive.
        ShutdownRequested: The node has to end.
    """
    for endpoint in endpoints:
        if is_writer(endpoint):
            continue
        for (topic, sender), number in numbers.items():
            if topic == endpoint.topic:
                _wait_for_message(endpoint, sender, number, running=running, before=before.get((topic, sender), 0))


def _wait_for_message(endpoint: Endpoint, sender: str, number: int, running: Callable[[], bool], before: int) -> None:
    subscription = endpoint.subscription
    if not wait_for(lambda: subscription.number(sender, before) == number, LOCKSTEP_TIMEOUT, running, step=1e-4):
        raise MiddlewareError(
            f"message {number} of {sender} on topic {endpoint.topic} has not arrived within {LOCKSTEP_TIMEOUT:g} s",
            expected="in lock-step every message to arrive",
        )


def wait_for_connections(endpoints: Sequence[Endpoint], network: LockstepNetwork, running: Callable[[], bool]) -> None:
    """Wait until all nodes that write what this node reads, or read what it writes, are connected to it.

    Raises:
        ShutdownRequested: The node has to end.
    """
    for endpoint, nodes in zip(endpoints, network.others(endpoints), strict=True):
        writes = is_writer(endpoint)
        connected = endpoint.topic_publisher.receivers if writes else endpoint.subscription.senders
        missing = _wait_for_nodes(nodes - {network.name}, connected, running)
        if missing:
            logger.warning(
                "topic %s: no connection to %s; it does not take part in the lock-step",
                endpoint.topic,
                ", ".join(sorted(missing)),
            )


def _wait_for_nodes(nodes: set[str], connected: Callable[[], set[str]], running: Callable[[], bool]) -> set[str]:
    """Wait until the nodes are connected; returns those that are not connected in time."""
    wait_for(lambda: nodes <= connected(), LOCKSTEP_TIMEOUT, running)
    return nodes - connected()


class LockstepClient:
    """Makes a node's cycles when the simulation requests them.

    Args:
        network: Its middleware.
        clock: Its clock.
        endpoints: Its topics; a live list.
        requests: Returns the requests to services that are not answered yet.
        running: False as soon as the end was requested.
    """

    def __init__(
        self,
        network: LockstepNetwork,
        clock: StepClock,
        endpoints: Sequence[Endpoint],
        requests: Callable[[], Sequence[Future]],
        running: Callable[[], bool],
    ):
        self._network = network
        self._clock = clock
        self._endpoints = endpoints
        self._requests = requests
        self._running = running
        self._withdraw: Callable[[], None] | None = None
        self._published: dict[str, int] = {}

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; the first call joins the simulation."""
        wait(self._requests())
        if self._withdraw is None:
            wait_for_connections(self._endpoints, self._network, self._running)
            self._withdraw = self._network.offer(self._answer)
        self._clock.sleep_until(deadline)

    def close(self) -> None:
        """Stop following."""
        if self._withdraw is not None:
            self._withdraw()

    def _answer(self, tick: Tick) -> Ticked:
        keys = tuple(zip(tick.topics, tick.senders, strict=True))
        numbers = dict(zip(keys, tick.numbers, strict=True))
        before = dict(zip(keys, tick.before, strict=True))
        try:
            due = self._clock.grant(
                tick.time, lambda: wait_for_messages(self._endpoints, numbers, self._running, before=before)
            )
        except ShutdownRequested as error:
            raise MiddlewareError(str(error), expected="a node that goes on") from error
        # a simulator that was started again cannot wait for messages that the one before received
        newest = published_counts(self._endpoints)
        news = {topic: number for topic, number in newest.items() if self._published.get(topic, 0) != number}
        self._published |= news
        return Ticked(due, list(news), list(news.values()))
