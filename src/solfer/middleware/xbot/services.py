"""Services over rings of commands with a reply. The loop of the one who offers them looks for calls between cycles."""

import logging
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from solfer.components.declaration import Service
from solfer.errors import MiddlewareError, SolferError
from solfer.logs import Throttle
from solfer.middleware.xbot.channel import DONE, FAILED, Channel, interface_of, packed, unpacked
from solfer.middleware.xbot.lock import remove
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.segment import Segment
from solfer.pipes.middleware import Submit

logger = logging.getLogger(__name__)

SERVICES, OFFER, CALLS = "services", "offer", "calls"
KIND = "service"


@dataclass
class _Call:
    """A call that is being carried out.

    Attributes:
        channel: Where the reply goes.
        number: The client's number of the call.
        latest: When the service gives it up [s].
        awaited: When the client gives it up [s].
        preparation: What takes long; its result is for the loop. None: nothing, or it is done.
        answer: The reply to come, once the loop has the call.
    """

    channel: Channel
    number: int
    latest: float
    awaited: float
    preparation: "Future[Callable[[], Any]] | None" = None
    answer: "Future[Any] | None" = None


class Offer:
    """A service that this process offers.

    Args:
        namespace: Where.
        owner: Who offers it; its name is `<owner>/<service's name>`.
        service: The declaration.
        submit: Takes calls to the loop.
        now: Clock [s].
        worker: Does what takes long, outside of the loop.

    Raises:
        MiddlewareError: Another process or node offers it already.
    """

    def __init__(self, namespace: Namespace, owner: str, service: Service, submit: Submit, now: Callable[[], float],
                 worker: ThreadPoolExecutor):
        self.name, self._owner, self._service, self._submit = f"{owner}/{service.name}", owner, service, submit
        self._namespace, self._now, self._worker = namespace, now, worker
        self._interface = interface_of(service.interface, service.request, service.reply)
        self._segment = Segment.create(namespace.place(SERVICES, self.name, OFFER), KIND, self._interface, 0)
        self._channels: dict[str, Channel] = {}
        self._open: list[_Call] = []
        self._throttle = Throttle(logger)
        self._bell = namespace.bell(SERVICES, self.name)

    def poll(self) -> None:
        """Take calls that have come, and answer those that are done. To be called by the loop's thread."""
        if self._bell.rung():
            self._find()
        for channel in self._channels.values():
            while (request := channel.requests.receive()) is not None:
                number, (awaited, fields) = request
                now = self._now()
                if now < awaited:  # else its client has given up: we were not here, or stood still
                    self._open.append(_Call(channel, number, now + self._service.timeout, awaited))
                    self._begin(self._open[-1], fields)
        if self._open:
            self._open = [call for call in self._open if not self._advance(call)]

    @property
    def busy(self) -> bool:
        """Whether there are clients, so that calls may come without a ring."""
        return bool(self._channels)

    def close(self) -> None:
        """Offer it no more."""
        self._segment.close()

    def _find(self) -> None:
        """Look for clients that are new, and clear away after those that have ended."""
        self._bell.hear()
        found = {}
        for name in self._namespace.present(SERVICES, self.name, CALLS):
            path = self._namespace.path(SERVICES, self.name, CALLS, name)
            try:
                channel = self._channels.get(name) or Channel.join(path, self._interface)
                if channel.segment.owned():
                    found[name] = channel
                else:
                    remove(path)
            except MiddlewareError as error:
                self._throttle.warning(name, "service %s: %s", self.name, error)
        self._channels = found
        self._open = [call for call in self._open if call.channel in found.values()]

    def _begin(self, call: _Call, fields: dict[str, Any]) -> None:
        try:
            request = unpacked(self._service.request, fields)
        except SolferError as error:
            call.answer = _failed(error)
            return
        if self._service.prepare is None:
            call.answer = self._submit(self._service.prepared(request))
        else:
            call.preparation = self._worker.submit(self._service.prepared, request)

    def _advance(self, call: _Call) -> bool:
        """Bring a call further; true if it was replied to, or its client has given up or ended."""
        if call.preparation is not None and call.preparation.done():
            error = call.preparation.exception()
            call.answer = self._submit(call.preparation.result()) if error is None else _failed(error)
            call.preparation = None
        if call.answer is not None and call.answer.done():
            return self._reply(call, self._result(call.answer)) or call.channel.segment.retired
        now, ended = self._now(), call.channel.segment.retired
        if now <= min(call.latest, call.awaited) and not ended:
            return False
        for work in (call.preparation, call.answer):
            if work is not None:
                work.cancel()
        if now <= call.awaited and not ended:
            within = self._service.timeout
            self._reply(call, self._refusal(f"{self._owner} does not run: no answer of its loop within {within:g} s"))
        return True

    def _reply(self, call: _Call, reply: Any) -> bool:
        """Send a reply; false if there is no room for it at present."""
        try:
            return call.channel.replies.send(call.number, [DONE, packed(reply)])
        except MiddlewareError as error:
            return call.channel.replies.send(call.number, [FAILED, f"its reply cannot be sent: {error}"])

    def _result(self, answer: "Future[Any]") -> Any:
        """The reply; whatever went wrong is one that says so."""
        error = answer.exception()
        if error is None:
            return answer.result()
        if isinstance(error, SolferError):
            return self._refusal(str(error))
        logger.error("service %s fails", self.name, exc_info=error)
        return self._refusal(f"{type(error).__name__}: {error}")

    def _refusal(self, message: str) -> Any:
        return self._service.reply(success=False, message=message)


def _failed(error: BaseException) -> "Future[Any]":
    answer: Future[Any] = Future()
    answer.set_exception(error)
    return answer


def offered(namespace: Namespace, name: str) -> Segment | None:
    """The offer of a service by somebody who lives."""
    try:
        segment = Segment.attach(namespace.path(SERVICES, name, OFFER), KIND)
    except MiddlewareError:
        return None
    return segment if segment.owned() else None


def services_of(namespace: Namespace) -> list[str]:
    """Names of all services that somebody offers."""
    return [name for name in namespace.present(SERVICES) if offered(namespace, name) is not None]


def client_name(node: str) -> str:
    """Name of a client's segment, which no other process has."""
    return f"{node}:{os.getpid()}"
