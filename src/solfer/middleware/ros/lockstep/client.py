"""Lock-step: a simulation waits after each step until the nodes that follow it have made the cycles that are due.

Each tick names the messages that the follower has to have received before, and each acknowledgement those that it has
sent. So what a cycle reads depends on simulated time only, however long messages are in progress.
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, wait
from typing import Any

import rosgraph
import rospy

from solfer.errors import ConfigError, MiddlewareError
from solfer.middleware.ros.codecs.interfaces import service_class
from solfer.middleware.ros.endpoints import LOCKSTEP_TIMEOUT, RosQueue, RosReader, RosWriter
from solfer.middleware.ros.lockstep.step_clock import StepClock
from solfer.middleware.ros.node.waiting import ShutdownRequested, wait_for

logger = logging.getLogger(__name__)

TICK = "solfer/Tick"
"""Interface of the service by which a node follows."""

SERVICE = "lockstep/tick"
"""Its name, behind the node's."""

Endpoint = RosReader | RosQueue | RosWriter
Numbers = dict[tuple[str, str], int]
"""Number of the newest message on a topic by a sender."""

NO_NUMBERS: Numbers = {}


def followers() -> tuple[str, ...]:
    """Read the full names of the nodes that follow the simulation; empty: there is no lock-step.

    The parameter `/lockstep` names them in the order of their cycles: 'upper_body, lower_body'.

    Raises:
        ConfigError: The parameter is not a list of names, or names a node twice.
    """
    value = rospy.get_param("/lockstep", "")
    if not isinstance(value, str):
        raise ConfigError(f"not a list of nodes: '{value}'", where="parameter /lockstep", expected="NAME, NAME, ...")
    names = tuple(rosgraph.names.resolve_name(name.strip(), "/") for name in value.split(",") if name.strip())
    if len(set(names)) < len(names):
        raise ConfigError(f"a node twice in '{value}'", where="parameter /lockstep", expected="each node once")
    return names


def published_counts(endpoints: Iterable[Endpoint]) -> dict[str, int]:
    """Return the number of the newest message on each topic that a node writes."""
    return {
        endpoint.topic: endpoint.topic_publisher.number() for endpoint in endpoints if isinstance(endpoint, RosWriter)
    }


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
        if isinstance(endpoint, RosWriter):
            continue
        for (topic, sender), number in numbers.items():
            if topic == endpoint.topic:
                _wait_for_message(endpoint, sender, number, running=running, before=before.get((topic, sender), 0))


def _wait_for_message(
    endpoint: RosReader | RosQueue, sender: str, number: int, running: Callable[[], bool], before: int
) -> None:
    subscription = endpoint.subscription
    if not wait_for(lambda: subscription.number(sender, before) == number, LOCKSTEP_TIMEOUT, running, step=1e-4):
        raise MiddlewareError(
            f"message {number} of {sender} on topic {endpoint.topic} has not arrived within {LOCKSTEP_TIMEOUT:g} s",
            expected="in lock-step every message to arrive",
        )


def wait_for_connections(endpoints: Iterable[Endpoint], name: str, running: Callable[[], bool]) -> None:
    """Wait until all nodes that write what node `name` reads, or read what it writes, are connected to it.

    Raises:
        ShutdownRequested: The node has to end.
    """
    publishers, subscribers, _ = rosgraph.Master(name).getSystemState()
    writing = dict(publishers)
    reading = dict(subscribers)
    for endpoint in endpoints:
        if isinstance(endpoint, RosWriter):
            nodes = reading.get(endpoint.topic, [])
            connected = endpoint.topic_publisher.receivers
        else:
            nodes = writing.get(endpoint.topic, [])
            connected = endpoint.subscription.senders
        missing = _wait_for_nodes(set(nodes) - {name}, connected, running)
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
        name: Name of the node.
        clock: Its clock.
        endpoints: Its topics; a live list.
        requests: Returns the requests to services that are not answered yet.
        running: False as soon as the end was requested.
    """

    def __init__(
        self,
        name: str,
        clock: StepClock,
        endpoints: Sequence[Endpoint],
        requests: Callable[[], Sequence[Future]],
        running: Callable[[], bool],
    ):
        self._name = name
        self._clock = clock
        self._endpoints = endpoints
        self._requests = requests
        self._running = running
        self._server: rospy.Service | None = None
        self._published: dict[str, int] = {}

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; the first call joins the simulation."""
        wait(self._requests())
        if self._server is None:
            wait_for_connections(self._endpoints, self._name, self._running)
            self._server = rospy.Service(f"{self._name}/{SERVICE}", service_class(TICK), self._answer)
        self._clock.sleep_until(deadline)

    def close(self) -> None:
        """Stop following."""
        if self._server is not None:
            self._server.shutdown()

    def _answer(self, tick: Any) -> Any:
        keys = tuple(zip(tick.topics, tick.senders, strict=True))
        numbers = dict(zip(keys, tick.numbers, strict=True))
        before = dict(zip(keys, tick.before, strict=True))
        try:
            due = self._clock.grant(
                tick.time, lambda: wait_for_messages(self._endpoints, numbers, self._running, before=before)
            )
        except (ShutdownRequested, MiddlewareError) as error:
            raise rospy.ServiceException(str(error)) from error
        # a simulator that was started again cannot wait for messages that the one before received
        newest = published_counts(self._endpoints)
        news = {topic: number for topic, number in newest.items() if self._published.get(topic, 0) != number}
        self._published |= news
        return service_class(TICK)._response_class(due, list(news), list(news.values()))
