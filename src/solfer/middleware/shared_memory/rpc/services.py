"""Services over rings of requests and replies. The loop of the node that offers them polls for calls between cycles."""

import logging
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from solfer.errors import MiddlewareError, SolferError, described, located
from solfer.interfaces.declaration import Service
from solfer.middleware.shared_memory.rpc.channel import DONE, FAILED, RpcChannel, interface_of, packed, unpacked
from solfer.segments.lock import remove
from solfer.segments.namespace import Namespace
from solfer.segments.segment import Segment
from solfer.throttle import Throttle
from solfer.transport.middleware import Submit

logger = logging.getLogger(__name__)

SERVICES = "services"
OFFER = "offer"
CALLS = "calls"
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

    channel: RpcChannel
    number: int
    latest: float
    awaited: float
    preparation: "Future[Callable[[], Any]] | None" = None
    answer: "Future[Any] | None" = None


class ServiceServer:
    """A service that this process offers.

    Args:
        namespace: Where.
        owner: Name of the node or plugin that offers it; its name is `<owner>/<service's name>`.
        service: The declaration.
        submit: Passes calls to the loop.
        now: Clock [s].
        worker: Does what takes long, outside of the loop.

    Raises:
        MiddlewareError: Another process or node offers it already.
    """

    def __init__(
        self,
        namespace: Namespace,
        owner: str,
        service: Service,
        submit: Submit,
        now: Callable[[], float],
        *,
        worker: ThreadPoolExecutor,
    ):
        self.name = f"{owner}/{service.name}"
        self._owner = owner
        self._service = service
        self._submit = submit
        self._namespace = namespace
        self._now = now
        self._worker = worker
        self._interface = interface_of(service.interface, service.request, service.reply)
        self._segment = Segment.create(namespace.place(SERVICES, self.name, OFFER), KIND, self._interface, size=0)
        self._channels: dict[str, RpcChannel] = {}
        self._open: list[_Call] = []
        self._throttle = Throttle(logger)
        self._notification = namespace.notification(SERVICES, self.name)

    def poll(self) -> None:
        """Receive calls, and answer those that are done. To be called by the loop's thread."""
        if self._notification.is_pending():
            self._find()
        for channel in self._channels.values():
            while (request := channel.requests.receive()) is not None:
                number, (awaited, fields) = request
                now = self._now()
                if now < awaited:  # else its client has given up: this process stood still
                    self._open.append(_Call(channel, number, now + self._service.timeout, awaited=awaited))
                    self._begin(self._open[-1], fields)
        if self._open:
            self._open = [call for call in self._open if not self._advance(call)]

    @property
    def busy(self) -> bool:
        """Whether there are clients, so that calls may come without a notification."""
        return bool(self._channels)

    def close(self) -> None:
        """Withdraw the offer."""
        self._segment.close()

    def _find(self) -> None:
        """Join clients that are new, and clean up after those that have ended."""
        self._notification.acknowledge()
        found = {}
        for name in self._namespace.present(SERVICES, self.name, CALLS):
            path = self._namespace.path(SERVICES, self.name, CALLS, name)
            try:
                channel = self._channels.get(name)
                if channel is None or not channel.segment.owned():  # a client of the same name may be another one
                    channel = RpcChannel.join(path, self._interface)
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
        """Advance a call; returns true if it was replied to, or its client has given up or ended."""
        if call.preparation is not None and call.preparation.done():
            error = call.preparation.exception()
            call.answer = self._submit(call.preparation.result()) if error is None else _failed(error)
            call.preparation = None
        if call.answer is not None and call.answer.done():
            return self._reply(call, self._result(call.answer)) or call.channel.segment.retired
        now = self._now()
        ended = call.channel.segment.retired
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
        """Send a reply; returns false if there is no room for it at present."""
        try:
            return call.channel.replies.send(call.number, [DONE, packed(reply)])
        except BaseException as error:  # a component has made the reply, and may have made anything
            return call.channel.replies.send(call.number, [FAILED, f"its reply cannot be sent: {described(error)}"])

    def _result(self, answer: "Future[Any]") -> Any:
        """Return the reply; a failure becomes a refusal with its message."""
        error = answer.exception()
        if error is None:
            return answer.result()
        if isinstance(error, SolferError):
            return self._refusal(described(error, lines=True))
        logger.error("service %s fails", self.name, exc_info=error)
        return self._refusal(located(error))

    def _refusal(self, message: str) -> Any:
        return self._service.reply(success=False, message=message)


def _failed(error: BaseException) -> "Future[Any]":
    answer: Future[Any] = Future()
    answer.set_exception(error)
    return answer


def offered(namespace: Namespace, name: str) -> Segment | None:
    """Attach the offer of a service by a living process; None if there is none."""
    try:
        segment = Segment.attach(namespace.path(SERVICES, name, OFFER), KIND)
    except MiddlewareError:
        return None
    return segment if segment.owned() else None


def services_of(namespace: Namespace) -> list[str]:
    """List all services that are offered."""
    return [name for name in namespace.present(SERVICES) if offered(namespace, name) is not None]


def client_name(node: str) -> str:
    """Name a client's segment, uniquely among all processes."""
    return f"{node}:{os.getpid()}"
