"""Calls of services, from the side of the client."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from solfer.errors import MiddlewareError, ServiceUnavailable, nearest
from solfer.middleware.shared_memory.memory.namespace import Namespace
from solfer.middleware.shared_memory.memory.segment import Segment
from solfer.middleware.shared_memory.rpc.channel import DONE, RpcChannel, interface_of, packed, unpacked
from solfer.middleware.shared_memory.rpc.services import CALLS, SERVICES, client_name, offered, services_of


@dataclass
class _Asked:
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
        self._namespace, self._client, self._now = namespace, client_name(node), now
        self._offers: dict[str, Segment] = {}
        self._channels: dict[tuple[str, bytes], RpcChannel] = {}
        self.open: list[_Asked] = []
        self._count = 0

    def ask(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """Call a service as soon as it is offered; `poll` completes the Future. See `Middleware.request`."""
        self._count += 1
        asked = _Asked(
            name.lstrip("/"),
            interface_of(interface, type(request), reply),
            request,
            reply=reply,
            answer=Future(),
            timeout=timeout,
            latest=self._now() + timeout,
            number=self._count,
        )
        self.open.append(asked)
        self.poll()
        return asked.answer

    def poll(self) -> None:
        """Send what can be sent, and receive replies."""
        if not self.open:
            return
        for channel in self._channels.values():
            while (reply := channel.replies.receive()) is not None:
                self._answer(*reply)
        for asked in self.open:
            try:
                self._advance(asked)
            except MiddlewareError as error:
                asked.answer.set_exception(error)
        self.open = [asked for asked in self.open if not asked.answer.done()]

    def close(self) -> None:
        """Close the channels; calls without a reply fail."""
        for asked in self.open:
            asked.answer.set_exception(
                MiddlewareError(
                    f"the caller of service '{asked.name}' ends",
                    expected="a caller that runs until the answer is there",
                )
            )
        self.open = []
        for (name, _), channel in self._channels.items():
            channel.segment.close(for_good=True)
            self._namespace.bell(SERVICES, name).ring()

    def _advance(self, asked: _Asked) -> None:
        if asked.answer.done():
            return
        if not asked.sent and self._offered(asked):
            asked.sent = self._channel(asked).requests.send(asked.number, [asked.latest, packed(asked.request)])
        if self._now() < asked.latest:
            return
        if not asked.sent and not self._offered(asked):
            raise ServiceUnavailable(
                f"no node offers the service '{asked.name}' (waited {asked.timeout:g} s)",
                names=nearest(asked.name, services_of(self._namespace)),
            )
        raise MiddlewareError(
            f"service '{asked.name}' does not answer (waited {asked.timeout:g} s)",
            expected="an owner that runs; one that is held up does not answer",
        )

    def _offered(self, asked: _Asked) -> bool:
        """Return whether the service of a call is offered.

        Raises:
            MiddlewareError: It has another interface.
        """
        segment = self._offers.get(asked.name)
        if segment is None or segment.retired:
            segment = offered(self._namespace, asked.name)
            if segment is None:
                self._offers.pop(asked.name, None)
                return False
            self._offers[asked.name] = segment
        if segment.layout != asked.interface:
            raise MiddlewareError(
                f"service '{asked.name}' is {segment.layout.decode()}",
                where=str(segment.path),
                expected=asked.interface.decode(),
            )
        return True

    def _channel(self, asked: _Asked) -> RpcChannel:
        key = asked.name, asked.interface
        if key not in self._channels:
            path = self._namespace.place(SERVICES, asked.name, CALLS, self._client)
            self._channels[key] = RpcChannel.open(path, asked.interface)
            self._namespace.bell(SERVICES, asked.name).ring()
        return self._channels[key]

    def _answer(self, number: int, content: Any) -> None:
        asked = next((each for each in self.open if each.number == number), None)
        if asked is None or asked.answer.done():
            return  # it came too late
        state, published = content
        if state == DONE:
            asked.answer.set_result(unpacked(asked.reply, published))
        else:
            reason = published
            asked.answer.set_exception(MiddlewareError(f"service '{asked.name}' fails: {reason}"))
