"""What pages request: it arrives in viser's threads, and is carried out in the loop of the page."""

import logging
from collections.abc import Callable
from concurrent.futures import Future
from queue import Empty, SimpleQueue
from typing import Any

from viser import ViserServer

from solfer.errors import MiddlewareError, SolferError, described
from solfer.transport import Middleware

SERVICE_PATIENCE = 2.0
"""Longest wait for an answer of a service [s]."""

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
        self._pending = SimpleQueue[Callable[[], None]]()
        self._answers: list[tuple[Future[Any], str, Callable[[Any], None]]] = []

    def submit(self, work: Callable[[], None]) -> None:
        """Let the loop do some work; from any thread."""
        self._pending.put(work)

    def call(
        self, service: str, interface: str, request: Any, reply: type, done: Callable[[Any], None] = lambda _: None
    ) -> None:
        """Call a service, from the loop alone; a refusal is shown. `done` gets the reply, or None, in the loop."""
        answer = self.middleware.request(self.middleware.resolve(service), interface, request, reply, SERVICE_PATIENCE)
        self._answers.append((answer, service, done))

    def update(self) -> None:
        """Carry out what is there."""
        while True:
            try:
                work = self._pending.get_nowait()
            except Empty:
                break
            work()
        waiting = self._answers
        self._answers = []
        for answer, service, done in waiting:
            if answer.done():
                self._finish(answer, service, done)
            else:
                self._answers.append((answer, service, done))

    def show(self, text: str) -> None:
        """Show what has failed on all pages."""
        logger.warning("%s", text)
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
