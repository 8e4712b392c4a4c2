"""Calls from outside, carried out between two cycles."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from solfer.errors import MiddlewareError


class Inbox:
    """Takes calls from any thread; the loop that owns it applies them.

    Args:
        refusal: Why nothing is accepted at present; empty while calls are applied.
    """

    def __init__(self, refusal: str = "") -> None:
        self.refusal = refusal
        self._calls: deque[tuple[Callable[[], Any], Future[Any]]] = deque()

    def submit(self, call: Callable[[], Any]) -> "Future[Any]":
        """Queue `call`; the Future holds its result or its error after the next cycle."""
        future: Future[Any] = Future()
        self._calls.append((call, future))
        return future

    def apply(self) -> None:
        """Carry out what is queued, or answer it with the `refusal`. An error of a call goes to its caller alone."""
        while self._calls:
            call, future = self._calls.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                if self.refusal:
                    raise MiddlewareError(self.refusal)
                future.set_result(call())
            except Exception as error:  # belongs to the caller, who gets it from the Future
                future.set_exception(error)
