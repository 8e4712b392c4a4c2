"""Services of one middleware, offered on another."""

import logging
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from typing import Any

from solfer.components.declaration import Service
from solfer.errors import SolferError
from solfer.pipes.middleware import Middleware

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Offer:
    """A service that somebody offers.

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


class Forwarding:
    """Takes requests outside and asks inside. Requests come from any thread, the inside is used by `run` only.

    Args:
        inside: Where the services are.
        outside: Where they are offered as well.

    Attributes:
        names: Services that are forwarded.
        requests: Number of requests so far.
    """

    def __init__(self, inside: Middleware, outside: Middleware):
        self._inside, self._outside = inside, outside
        self.names: set[str] = set()
        self.requests = 0
        self._waiting: deque[tuple[Callable[[], Future[Any]], Future[Any]]] = deque()
        self._asked: list[tuple[Future[Any], Future[Any]]] = []

    def offer(self, offers: Iterable[Offer]) -> None:
        """Offer what is not offered yet.

        Raises:
            SolferError: The outside refuses: another one offers a service of that name, or its type is unknown.
        """
        for offer in offers:
            if offer.name not in self.names:
                self.names.add(offer.name)
                owner, _, _ = offer.name.rpartition("/")
                self._outside.serve(owner, (self._service(offer),), self._submit)

    def run(self) -> None:
        """Ask what has come in, and hand on the replies that are there."""
        while self._waiting:
            ask, answer = self._waiting.popleft()
            if not answer.set_running_or_notify_cancel():
                continue
            self.requests += 1
            try:
                self._asked.append((ask(), answer))
            except SolferError as error:
                answer.set_exception(error)
        if self._asked:
            self._asked = [pair for pair in self._asked if not self._answered(*pair)]

    def close(self) -> None:
        """Answer all that wait: there will be no reply."""
        while self._waiting:
            self._waiting.popleft()[1].cancel()

    def _service(self, offer: Offer) -> Service:
        def ask(request: Any) -> "Future[Any]":
            return self._inside.request(offer.name, offer.interface, request, offer.reply, offer.timeout)

        # The one who asks waits a little longer than the bridge, whose refusal says more.
        return Service(offer.name.rpartition("/")[2], offer.interface, offer.request, offer.reply, ask,
                       timeout=offer.timeout + 0.5)

    def _submit(self, ask: Callable[[], Any]) -> "Future[Any]":
        answer: Future[Any] = Future()
        self._waiting.append((ask, answer))
        return answer

    def _answered(self, asked: "Future[Any]", answer: "Future[Any]") -> bool:
        if not asked.done():
            return False
        try:
            answer.set_result(asked.result())
        except (SolferError, CancelledError) as error:
            answer.set_exception(error)
        return True
