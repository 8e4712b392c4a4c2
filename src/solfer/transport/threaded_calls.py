"""Services and calls of middlewares that have threads of their own."""

import dataclasses
import logging
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

from solfer.errors import ComponentError, Overtaken, SolferError, described, located
from solfer.interfaces.declaration import Service
from solfer.transport.middleware import Submit

logger = logging.getLogger(__name__)


class ThreadedService:
    """A declared service whose requests wait in a thread until the loop has carried them out between two cycles.

    Args:
        owner: Name of the part that offers it.
        service: The declaration.
        submit: Passes calls to the loop.
        running: False when the node has to end.

    Attributes:
        name: Its name, `<owner>/<service's name>`, before it is resolved.
        service: As given.
        done: Called after each request that was carried out.
    """

    def __init__(self, owner: str, service: Service, submit: Submit, running: Callable[[], bool]):
        self.name = f"{owner}/{service.name}"
        self.service = service
        self.done: Callable[[], None] = lambda: None
        self._owner = owner
        self._submit = submit
        self._running = running

    def match(self, request: set[str], reply: set[str]) -> None:
        """Compare the fields of the declaration with those of its interface; a reply may have a success and a message.

        Raises:
            ComponentError: They differ.
        """
        for what, declared, expected in (
            ("request", self.service.request, request),
            ("reply", self.service.reply, reply | {"success", "message"}),
        ):
            fields = {field.name for field in dataclasses.fields(declared)}
            if fields != expected:
                raise ComponentError(
                    f"the {what} {declared.__name__} of service {self.name} has fields {', '.join(sorted(fields))}",
                    expected=f"those of {self.service.interface}: {', '.join(sorted(expected))}",
                )

    def carry_out(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Carry out a request, and return the fields of its reply; every failure becomes one, see `refusal`."""
        if not self._running():
            return refusal(f"{self._owner} ends", later=True)
        future: Future[Any] = Future()
        try:
            for left in reversed(range(3)):  # others may overtake it, in whose threads they are prepared
                future = self._submit(self.service.prepared(self.service.request(**fields)))
                try:
                    reply = as_fields(future.result(self.service.timeout))
                    break
                except Overtaken:
                    if not left:
                        raise
        except SolferError as error:
            return refusal(described(error, lines=True))
        except (FutureTimeout, CancelledError):
            future.cancel()
            reason = f"no answer of its loop within {self.service.timeout:g} s"
            return refusal(f"{self._owner} does not run: {reason}", later=True)
        except BaseException as error:  # no signal comes to this thread
            logger.exception("service %s fails", self.name)
            return refusal(located(error))
        self.done()
        return reply


def refusal(message: str, later: bool = False) -> dict[str, Any]:
    """Return a reply without success; `later`: nothing is wrong with the request, it may be repeated."""
    return {"success": False, "message": message, "later": later}


def as_fields(made: Any) -> dict[str, Any]:
    """Return the fields of a dataclass, as they are."""
    return {field.name: getattr(made, field.name) for field in dataclasses.fields(made)}


def in_thread(work: Callable[[], Any]) -> "Future[Any]":
    """Run `work` in a thread of its own and return its result to come."""
    future: Future[Any] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except Exception as error:
            logger.debug("a call fails", exc_info=True)
            future.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return future
