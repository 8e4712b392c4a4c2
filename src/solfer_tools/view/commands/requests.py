"""What pages request: it arrives in viser's threads, and is carried out in the loop of the page."""

import logging
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from functools import partial
from threading import Lock
from typing import Any

from viser import ViserServer

from solfer.errors import MiddlewareError, SolferError, described
from solfer.throttle import Throttle
from solfer.transport import Middleware

logger = logging.getLogger(__name__)


class PageRequests:
    """Carries out what pages request, and calls services.

    Args:
        middleware: Has the services.
        viser: The pages, which show what has failed.

    Attributes:
        middleware: See above.
    """

    def __init__(self, middleware: Middleware, viser: ViserServer):
        self.middleware = middleware
        self._viser = viser
        self._throttle = Throttle(logger)
        self._lock = Lock()
        self._pending: dict[Hashable, Callable[[], None]] = {}
        self._answers: list[tuple[Future[Any], str, Callable[[Any], None]]] = []

    def submit(self, key: Hashable, work: Callable[[], None]) -> None:
        """Let the loop do some work; from any thread. It overtakes what waits with the same key."""
        with self._lock:
            self._pending.pop(key, None)
            self._pending[key] = work

    def call(
        self, service: str, interface: str, request: Any, reply: type, done: Callable[[Any], None] = lambda _: None
    ) -> None:
        """Call a service, from the loop alone; a refusal is shown. `done` gets the reply, or None, in the loop."""
        timeout = 2.0  # [s]
        answer = self.middleware.request(self.middleware.resolve(service), interface, request, reply, timeout)
        self.follow(answer, service, done)

    def follow(self, answer: Future[Any], service: str, done: Callable[[Any], None]) -> None:
        """Wait for the reply of a service that was called, as `call` does; from the loop alone."""
        self._answers.append((answer, service, done))

    def update(self) -> None:
        """Carry out what is there."""
        with self._lock:
            pending = self._pending
            self._pending = {}
        for work in pending.values():
            self.carry_out("a request of a page", work)
        waiting = self._answers
        self._answers = []
        for answer, service, done in waiting:
            if answer.done():
                self.carry_out("a request of a page", partial(self._finish, answer, service, done))
            else:
                self._answers.append((answer, service, done))

    def carry_out(self, name: str, work: Callable[[], None]) -> None:
        """Do some work of the loop; if it fails, that is logged, once a second for each name."""
        try:
            work()
        except Exception as error:  # it must not end the emergency stop of all pages
            self._throttle.warning(name, "%s failed: %s", name, described(error))

    def show(self, text: str) -> None:
        """Show what has failed on all pages, once a second."""
        if not self._throttle.warning(text, "%s", text):
            return
        for client in self._viser.get_clients().values():
            client.add_notification("solfer", text, color="red", auto_close_seconds=10.0)

    def _finish(self, answer: Future[Any], service: str, done: Callable[[Any], None]) -> None:
        try:
            reply = answer.result()
            if not reply.success:
                raise MiddlewareError(reply.message)
        except SolferError as error:
            self.show(f"{service}: {described(error, lines=True)}")
            reply = None
        done(reply)
