"""Calls of services, from the side of the client."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from solfer.errors import MiddlewareError, ServiceUnavailable, nearest
from solfer.middleware.shared_memory.rpc.channel import DONE, RpcChannel, interface_of, packed, unpacked
from solfer.middleware.shared_memory.rpc.services import CALLS, SERVICES, client_name, offered, services_of
from solfer.segments.namespace import Namespace
from solfer.segments.segment import Segment


@dataclass
class _PendingCall:
    """A call without a reply yet; `sent`: whether the service was there, `latest`: when the client gives up [s]."""

    name: str
    interface: bytes
    request: Any
    reply: type
    answer: "Future[Any]"
    timeout: float
    latest: float
    number: int
    sent: bool = False


class Calls:
    """Calls of one node.

    Args:
        namespace: Where the services are.
        node: Name of the node.
        now: Clock [s].

    Attributes:
        open: Calls without a reply yet.
    """

    def __init__(self, namespace: Namespace, node: str, now: Callable[[], float]):
        self._namespace = namespace
        self._client = client_name(node)
        self._now = now
        self._offers: dict[str, Segment] = {}
        self._channels: dict[tuple[str, bytes], RpcChannel] = {}
        self.open: list[_PendingCall] = []
        self._count = 0

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """Call a service as soon as it is offered; `poll` completes the Future. See `Middleware.request`."""
        self._count += 1
        pending = _PendingCall(
            name.lstrip("/"),
            interface_of(interface, type(request), reply),
            request,
            reply=reply,
            answer=Future(),
            timeout=timeout,
            latest=self._now() + timeout,
            number=self._count,
        )
        self.open.append(pending)
        self.poll()
        return pending.answer

    def poll(self) -> None:
        """Send what can be sent, and receive replies."""
        if not self.open:
            return
        for channel in self._channels.values():
            while (reply := channel.replies.receive()) is not None:
                self._answer(*reply)
        for pending in self.open:
            try:
                self._advance(pending)
            except MiddlewareError as error:
                pending.answer.set_exception(error)
        self.open = [pending for pending in self.open if not pending.answer.done()]

    def close(self) -> None:
        """Close the channels; calls without a reply fail."""
        for pending in self.open:
            pending.answer.set_exception(
                MiddlewareError(
                    f"the caller of service '{pending.name}' ends",
                    expected="a caller that runs until the answer is there",
                )
            )
        self.open = []
        for (name, _), channel in self._channels.items():
            channel.segment.close(for_good=True)
            self._namespace.notification(SERVICES, name).send()

    def _advance(self, pending: _PendingCall) -> None:
        if pending.answer.done():
            return
        if not pending.sent and self._offered(pending):
            pending.sent = self._channel(pending).requests.send(
                pending.number, [pending.latest, packed(pending.request)]
            )
        if self._now() < pending.latest:
            return
        if not pending.sent and not self._offered(pending):
            raise ServiceUnavailable(
                f"no node offers the service '{pending.name}' (waited {pending.timeout:g} s)",
                names=nearest(pending.name, services_of(self._namespace)),
            )
        raise MiddlewareError(
            f"service '{pending.name}' does not answer (waited {pending.timeout:g} s)",
            expected="an owner that runs; one that is held up does not answer",
        )

    def _offered(self, pending: _PendingCall) -> bool:
        """Return whether the service of a call is offered.

        Raises:
            MiddlewareError: It has another interface.
        """
        segment = self._offers.get(pending.name)
        if segment is None or segment.retired:
            segment = offered(self._namespace, pending.name)
            if segment is None:
                self._offers.pop(pending.name, None)
                return False
            self._offers[pending.name] = segment
        if segment.layout != pending.interface:
            raise MiddlewareError(
                f"service '{pending.name}' is {segment.layout.decode()}",
                where=str(segment.path),
                expected=pending.interface.decode(),
            )
        return True

    def _channel(self, pending: _PendingCall) -> RpcChannel:
        key = pending.name, pending.interface
        if key not in self._channels:
            path = self._namespace.place(SERVICES, pending.name, CALLS, self._client)
            self._channels[key] = RpcChannel.open(path, pending.interface)
            self._namespace.notification(SERVICES, pending.name).send()
        return self._channels[key]

    def _answer(self, number: int, content: Any) -> None:
        pending = next((each for each in self.open if each.number == number), None)
        if pending is None or pending.answer.done():
            return  # it came too late
        state, published = content
        if state == DONE:
            pending.answer.set_result(unpacked(pending.reply, published))
        else:
            reason = published
            pending.answer.set_exception(MiddlewareError(f"service '{pending.name}' fails: {reason}"))
