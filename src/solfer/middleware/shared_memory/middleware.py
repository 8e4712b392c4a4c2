"""The Middleware of a node without ROS, in shared memory."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol, cast

from solfer.errors import MiddlewareError, UnknownName
from solfer.interfaces.declaration import Service
from solfer.middleware.shared_memory.clock import MonotonicClock
from solfer.middleware.shared_memory.discovery import Survey
from solfer.middleware.shared_memory.health_reports import Reports
from solfer.middleware.shared_memory.rpc.calls import Calls
from solfer.middleware.shared_memory.rpc.services import ServiceServer
from solfer.middleware.shared_memory.simulated_time import SimulatedTime
from solfer.middleware.shared_memory.topics.endpoints import PendingMessages, XbotQueue, XbotReader, XbotWriter
from solfer.middleware.shared_memory.topics.subscriptions import Subscriptions
from solfer.segments.lock import locked
from solfer.segments.namespace import Namespace
from solfer.segments.segment import Segment
from solfer.transport.endpoints import JointOrder, Queue
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport, Middleware, Submit
from solfer.transport.topics import Topics

PROVIDED = "provided"
"""Folder of the parameters."""

CHECK_PERIOD = 1e-3
"""Time between two checks of a condition that is waited for [s]."""


class ClockProtocol(Protocol):
    """A clock that all processes of a namespace have in common."""

    def now(self) -> float:
        """Return the time [s], which never goes back."""

    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` [s], or at once when it has passed."""


class _ServedCalls:
    """Services of a node, which receive their calls as soon as a notification of the namespace is sent.

    Args:
        namespace: The namespace.

    Attributes:
        notification: Sent with each notification of the namespace.
        is_busy: Whether a service works on a call, or is new.
    """

    def __init__(self, namespace: Namespace):
        self._servers: list[ServiceServer] = []
        self.notification = namespace.any_notification()
        self.is_busy = True

    def add(self, server: ServiceServer) -> None:
        """Add a service."""
        self.is_busy = True
        self._servers.append(server)

    def poll(self) -> None:
        """Receive calls, if there are any. Does not block."""
        self.notification.acknowledge()
        for server in self._servers:
            server.poll()
        self.is_busy = any(server.busy for server in self._servers)

    def close(self) -> None:
        """End all services."""
        for server in self._servers:
            server.close()
        self._servers.clear()


class XbotMiddleware(Middleware):
    """Topics, services, parameters and reports in the shared memory of a namespace.

    All nodes of the namespace share its topic names. Services are answered, and replies to requests arrive, in `poll`,
    which `sleep_until` calls; a loop without `sleep_until` calls `poll` in each cycle.

    Args:
        namespace: Name of the namespace, or the namespace itself, which several nodes of one process may share.
        name: Name of the node; it is the sender of what it writes.
        parameters: Values that can be requested by name.
        clock: Clock of all nodes of the namespace; None: the machine's monotonic clock.
        listens: Whether it counts as a subscriber of the topics that it reads; a bridge, which only forwards, does not.

    Raises:
        MiddlewareError: There is no such namespace and none can be made.
    """

    def __init__(
        self,
        namespace: Namespace | str,
        name: str = "node",
        parameters: Mapping[str, Any] | None = None,
        clock: ClockProtocol | None = None,
        listens: bool = True,
    ):
        self.namespace = namespace if isinstance(namespace, Namespace) else Namespace(namespace)
        self.name = name
        self._clock = clock or MonotonicClock()
        # without a call in between: a cycle reads the time some thirty times
        self.now = self._clock.now  # type: ignore[method-assign]
        self._parameters = {key.lstrip("/"): value for key, value in (parameters or {}).items()}
        self._ended = False
        self._endpoints: list[XbotReader | XbotQueue | XbotWriter] = []
        self._provided: dict[str, Segment] = {}
        self._subscriptions = Subscriptions(self.namespace, name) if listens else None
        self._served = _ServedCalls(self.namespace)
        self._survey = Survey(self.namespace)
        self._calls = Calls(self.namespace, name, self.now)
        self._reports = Reports(self.namespace)
        self._simulated = SimulatedTime(self.namespace.folder)
        self._worker = ThreadPoolExecutor(1)

    @property
    def rewinds(self) -> int:
        """See `Middleware.rewinds`; of a simulation in this namespace."""
        return self._simulated.rewinds

    def rewind_words(self) -> Any:
        """See `Middleware.rewind_words`."""
        return self._simulated.words

    def now(self) -> float:
        """See `Middleware.now`."""
        return self._clock.now()

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; calls and replies are received afterwards."""
        self._clock.sleep_until(deadline)
        self.poll()

    def poll(self) -> None:
        """Receive calls of services and replies to requests. Does not block."""
        served = self._served
        if served.is_busy or served.notification.is_pending():
            served.poll()
        if self._calls.open:
            self._calls.poll()

    @staticmethod
    def poll_all(nodes: Iterable["XbotMiddleware"]) -> Callable[[], None]:
        """Return what polls several nodes in one call, each where it may have received something."""
        rows = [(node._served, node._served.notification, node._calls, node.poll) for node in nodes]

        def poll() -> None:
            for served, notification, calls, poll_one in rows:
                if served.is_busy or notification.words[notification.place] != notification.received or calls.open:
                    poll_one()

        return poll

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`; no clock follows it, but `rewinds` counts when it goes back."""
        self._simulated.publish(simulated)

    def end(self) -> None:
        """Request the end."""
        self._ended = True

    def running(self) -> bool:
        """See `Middleware.running`."""
        return not self._ended

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`; the node's own, else one that a living node has set with `provide`."""
        if name.lstrip("/") in self._parameters:
            return self._parameters[name.lstrip("/")]
        path = self.namespace.path(PROVIDED, name)
        try:
            segment = Segment.attach(path, "parameter") if path.exists() else None
        except MiddlewareError as error:
            raise error.at(where) from None
        if segment is None or not segment.owned():
            present = [each for each in self.namespace.present(PROVIDED) if locked(self.namespace.path(PROVIDED, each))]
            raise UnknownName("parameter", name, (*self._parameters, *present), where=where)
        return json.loads(segment.layout)

    def provide(self, name: str, value: Any) -> None:
        """Set a parameter of the namespace, which lasts as long as this node.

        Raises:
            MiddlewareError: There is no room for it, or another node provides it.
        """
        key = name.lstrip("/")
        content = json.dumps(value).encode()
        if key in self._provided:
            self._provided[key] = self._provided[key].recreate(content, 0)
        else:
            self._provided[key] = Segment.create(self.namespace.place(PROVIDED, name), "parameter", content, size=0)

    def reader(self, topic: str, message: str, kept: int = 0) -> XbotReader:
        """See `Middleware.reader`; of a sender no more are kept than its segment holds."""
        return self._keep(XbotReader(self.namespace, topic, message, now=self._clock.now, kept=kept), message)

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> XbotQueue:
        """See `Middleware.queue`; memory that is shared bounds its messages itself."""
        return self._keep(XbotQueue(self.namespace, topic, message, size=size), message)

    def declared_queue(self, topic: str, message: str) -> XbotQueue:
        """See `Middleware.declared_queue`; a bridge forwards what is published outside."""
        if self._subscriptions is not None:
            self._subscriptions.add(topic, message, declared=True)
        return self.queue(topic, message)

    def pending(self, queues: Sequence[Queue]) -> Callable[[], bool]:
        """See `Middleware.pending`."""
        return PendingMessages(cast(Sequence[XbotQueue], queues), self.namespace.any_notification())

    def writer(self, topic: str, message: str) -> XbotWriter:
        """See `Middleware.writer`.

        Raises:
            MiddlewareError: Another node of this name writes there, or the topic carries another message.
        """
        # each component of a node has a writer of its own
        writers = [each.topic.lstrip("/") for each in self._endpoints if isinstance(each, XbotWriter)]
        number = writers.count(topic.lstrip("/"))
        return self._keep(
            XbotWriter(self.namespace, topic, message, sender=self.name, now=self._clock.now, number=number)
        )

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`."""
        order = JointOrder(XbotReader(self.namespace, topic, message, now=self.now))
        end = self.now() + timeout
        while not order.read() and self.now() < end and self.running():
            self.sleep_until(self.now() + CHECK_PERIOD)
        return topic, tuple(order.names) or None

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`."""
        answer = self.request(name, interface, request, reply=reply, timeout=timeout)
        while not answer.done():
            if not self.running():
                raise MiddlewareError(
                    f"the caller of service '{name}' ends", expected="a caller that runs until the answer is there"
                )
            self.sleep_until(self.now() + CHECK_PERIOD)
        return answer.result()

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`; the reply comes in `poll`."""
        return self._calls.call(name, interface, request, reply, timeout)

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`.

        Raises:
            MiddlewareError: Another process or node offers such a service.
        """
        for service in services:
            self._served.add(
                ServiceServer(self.namespace, owner, service, submit=submit, now=self.now, worker=self._worker)
            )

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`; the answer is there at once: all segments of pipes are read."""
        answer: Future[Topics] = Future()
        answer.set_result(self._survey.topics_beside(self.name))
        return answer

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""
        self._reports.write(name, HealthReport(level, summary, values), self.now())

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        return self._reports.read()

    def close(self) -> None:
        """See `Middleware.close`; nothing is queued here."""
        owned = (self._served, *self._endpoints, *self._provided.values())
        for part in (*owned, self._calls, self._reports, *filter(None, (self._subscriptions,))):
            part.close()
        self._provided.clear()
        self._endpoints.clear()
        self._simulated.close()
        self._worker.shutdown(wait=False)

    def _keep(self, endpoint: Any, received: str = "") -> Any:
        """Keep an endpoint to close, and register it as a subscriber of the message `received`."""
        self._endpoints.append(endpoint)
        if received and self._subscriptions is not None:
            self._subscriptions.add(endpoint.topic, received)
        return endpoint
