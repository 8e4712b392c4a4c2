"""A middleware that connects to nothing."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from typing import Any

from solfer.errors import MiddlewareError
from solfer.interfaces.declaration import Service
from solfer.transport.endpoints import NullQueue, NullReader, NullWriter, Queue, Reader, Writer
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport, Middleware, Submit
from solfer.transport.topics import Topics


class UnconnectedMiddleware(Middleware):
    """Sends and receives nothing, and no time passes. A subclass knows parameters, and what to do about calls.

    Args:
        name: Name of the node.
    """

    def __init__(self, name: str):
        self.name = name
        self._services: set[str] = set()

    def now(self) -> float:
        """See `Middleware.now`; no time passes."""
        return 0.0

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`."""

    def running(self) -> bool:
        """See `Middleware.running`."""
        return False

    def reader(self, topic: str, message: str, kept: int = 0) -> Reader:
        """See `Middleware.reader`."""
        return NullReader(topic, message)

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Queue:
        """See `Middleware.queue`."""
        return NullQueue(topic)

    def writer(self, topic: str, message: str) -> Writer:
        """See `Middleware.writer`."""
        return NullWriter(topic, message)

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`; there is no reply."""
        return Future()

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`."""
        for service in services:
            if service.name in self._services:
                raise MiddlewareError(f"service '{owner}/{service.name}' is offered twice", expected="another name")
            self._services.add(service.name)

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`; there are none."""
        answer: Future[Topics] = Future()
        answer.set_result(Topics())
        return answer

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        return {}

    def close(self) -> None:
        """See `Middleware.close`."""

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`."""
        return topic, None
