"""Calls from outside, run between two cycles."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from solfer.errors import MiddlewareError
from solfer.transport.endpoints import Queue

_Call = tuple[Callable[[], Any], "Future[Any]"]


class Inbox:
    """Queues calls from any thread; the loop that owns the inbox runs them.

    Args:
        refusal: Why no call is accepted at present; empty while calls are run.
        ration: Most calls that are run in a cycle.
        waiting: Most calls that may wait; further calls are refused at once, and counted.

    Attributes:
        refused: Calls refused because too many others were waiting.
        most: The largest number of calls, urgent ones left out, that a cycle has run.
        waits: Whether a call may wait; a loop that finds nothing here, nor in `sources`, has nothing to `apply`.
        sources: Called with the `refusal` before the queued calls: they receive what comes in by topics.
        queues: Where what comes in by topics waits.
        pending: Returns whether anything may wait there; where nothing does, the sources are called only where there
            is a `refusal`.
    """

    def __init__(self, refusal: str = "", ration: int = 16, waiting: int = 64) -> None:
        self.refusal = refusal
        self.refused = 0
        self.most = 0
        self.waits = False
        self._ration = ration
        self._waiting = waiting
        self._calls: deque[_Call] = deque()
        self._urgent: deque[_Call] = deque()
        self._single: deque[_Call] = deque()
        self.sources: list[Callable[[str], None]] = []
        self.queues: list[Queue] = []
        self.pending: Callable[[], bool] = lambda: True

    def submit(self, call: Callable[[], Any]) -> "Future[Any]":
        """Queue `call`; the Future holds its result or its error after one of the next cycles.

        Where `call` itself returns a Future, that one's result is the answer, as soon as it is there.
        """
        return self._queue(self._calls, call)

    def submit_urgently(self, call: Callable[[], Any]) -> "Future[Any]":
        """Queue `call` before all others and outside the ration: it has to be a call that costs next to nothing."""
        return self._queue(self._urgent, call)

    def submit_one_by_one(self, call: Callable[[], Any]) -> "Future[Any]":
        """Queue `call` behind all others; of these one is run in a cycle, so that many cost it no more than one."""
        return self._queue(self._single, call)

    def apply(self) -> None:
        """Run the queued calls, or answer them with the `refusal`. An error of a call goes to its caller only.

        Raises:
            BaseException: A call raised a request to exit, such as SystemExit. Its caller gets it, too; the calls
                behind it stay queued.
        """
        self.waits = False  # before they are looked for: another thread may submit one meanwhile
        try:
            self._run()
        finally:
            if self._urgent or self._calls or self._single:
                self.waits = True

    def _run(self) -> None:
        """Run the queued calls; see `apply`."""
        if self.sources and (self.refusal or self.pending()):
            for receive in self.sources:
                receive(self.refusal)
        while self._urgent:
            self._carry_out(*self._urgent.popleft())
        count = 0
        while self._calls and (count < self._ration or self.refusal):
            self._carry_out(*self._calls.popleft())
            count += 1
        while self._single:
            self._carry_out(*self._single.popleft())
            if not self.refusal:
                break
        if count > self.most and not self.refusal:
            self.most = count

    def _queue(self, calls: "deque[_Call]", call: Callable[[], Any]) -> "Future[Any]":
        future: Future[Any] = Future()
        if len(calls) >= self._waiting:
            self.refused += 1
            error = MiddlewareError(f"{self._waiting} requests wait already", expected="a request later on")
            future.set_exception(error)
        else:
            calls.append((call, future))
            self.waits = True
        return future

    def _carry_out(self, call: Callable[[], Any], future: "Future[Any]") -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            if self.refusal:
                raise MiddlewareError(self.refusal)
            result = call()
            if isinstance(result, Future):
                result.add_done_callback(lambda done: pass_on(done, future))
            else:
                future.set_result(result)
        except BaseException as error:  # belongs to the caller, which gets it from the Future
            future.set_exception(error)
            if not isinstance(error, Exception):
                raise


def pass_on(done: "Future[Any]", future: "Future[Any]", changed: Callable[[Any], Any] = lambda reply: reply) -> None:
    """Answer as a call has done that took longer, with its reply `changed`."""
    error = done.exception()
    if error is None:
        future.set_result(changed(done.result()))
    else:
        future.set_exception(error)
