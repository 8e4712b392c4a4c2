"""Services of one middleware, offered on another."""

import logging
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from typing import Any

from solfer.errors import SolferError
from solfer.interfaces.declaration import Service
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class ServiceForward:
    """A service that is offered inside.

    Attributes:
        name: Full name, such as 'joint_states/trajectory'.
        interface: `package/Type`.
        request: Dataclass of the request.
        reply: Dataclass of the reply.
        timeout: Longest time until the reply [s].
    """

    name: str
    interface: str
    request: type
    reply: type
    timeout: float = 2.0


class ServiceForwarder:
    """Receives requests outside and calls inside. Requests come from any thread, the inside is used by `run` only.

    Args:
        inside: Where the services are.
        outside: Where they are offered as well.

    Attributes:
        names: Services that are forwarded.
        requests: Number of requests so far.
    """

    def __init__(self, inside: Middleware, outside: Middleware):
        self._inside = inside
        self._outside = outside
        self.names: set[str] = set()
        self.requests = 0
        self._waiting: deque[tuple[Callable[[], Future[Any]], Future[Any]]] = deque()
        self._sent: list[tuple[Future[Any], Future[Any]]] = []

    def offer(self, offers: Iterable[ServiceForward]) -> None:
        """Offer what is not offered yet.

        Raises:
            SolferError: The outside refuses: another node offers a service of that name, or its type is unknown.
        """
        for offer in offers:
            if offer.name not in self.names:
                self.names.add(offer.name)
                owner, _, _ = offer.name.rpartition("/")
                self._outside.serve(owner, (self._service(offer),), self._submit)

    def run(self) -> None:
        """Forward the requests that have come in, and the replies that are there."""
        while self._waiting:
            send, answer = self._waiting.popleft()
            if not answer.set_running_or_notify_cancel():
                continue
            self.requests += 1
            try:
                self._sent.append((send(), answer))
            except SolferError as error:
                answer.set_exception(error)
        if self._sent:
            self._sent = [pair for pair in self._sent if not self._answered(*pair)]

    def close(self) -> None:
        """Cancel all requests that wait."""
        while self._waiting:
            self._waiting.popleft()[1].cancel()

    def _service(self, offer: ServiceForward) -> Service:
        def send(request: Any) -> "Future[Any]":
            return self._inside.request(offer.name, offer.interface, request, offer.reply, offer.timeout)

        # The caller waits a little longer than the bridge, so that it gets the bridge's refusal, which is more precise.
        return Service(
            offer.name.rpartition("/")[2],
            offer.interface,
            offer.request,
            reply=offer.reply,
            handler=send,
            timeout=offer.timeout + 0.5,
        )

    def _submit(self, send: Callable[[], Any]) -> "Future[Any]":
        answer: Future[Any] = Future()
        self._waiting.append((send, answer))
        return answer

    def _answered(self, sent: "Future[Any]", answer: "Future[Any]") -> bool:
        if not sent.done():
            return False
        try:
            answer.set_result(sent.result())
        except (SolferError, CancelledError) as error:
            answer.set_exception(error)
        return True
