"""Services that components declare, as ROS services."""

import dataclasses
import logging
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

import rospy

from solfer.errors import ComponentError, MiddlewareError, Overtaken, SolferError, described, located
from solfer.interfaces.declaration import Service
from solfer.middleware.ros.calls import alive, plain, provider
from solfer.middleware.ros.codecs.bounded import RATE_TIMEOUT, Rate, bound_requests
from solfer.middleware.ros.codecs.interfaces import service_class
from solfer.transport.middleware import Submit

logger = logging.getLogger(__name__)

REQUESTS = Rate(500.0, 50)
"""Requests that this node decodes, in a second and at once."""

QUICK_LIMIT = (100.0, 20)
"""The same for each service that is urgent or quick."""


class _Instead:
    """Stands in for a request that is not decoded; rospy sets an attribute."""

    def __init__(self, reason: str):
        self.reason = reason


class RosService:
    """A declared service under a ROS name.

    A request waits in rospy's thread until the loop has carried it out between two cycles. Every failure is returned to
    the caller: `success` false, and a message.

    Args:
        owner: Name of the part that offers it; the service's name is `<owner>/<name>`.
        service: The declaration.
        submit: Passes calls to the loop.
        running: False when the node has to end.

    Attributes:
        name: Its name, before it is resolved.
        largest: Bytes of a request.
        done: Called after each request that was carried out.

    Raises:
        ComponentError: The dataclasses of the declaration differ from the service type.
        MiddlewareError: Another node offers a service of that name.
    """

    def __init__(self, owner: str, service: Service, submit: Submit, running: Callable[[], bool]):
        self._owner = owner
        self._service = service
        self._submit = submit
        self._running = running
        self._interface = service_class(service.interface)
        self.largest = service.largest
        self.done: Callable[[], None] = lambda: None
        self.name = name = f"{owner}/{service.name}"
        self._match(service.request, self._interface._request_class, "request", name=name)
        self._match(service.reply, self._interface._response_class, "reply", name=name)
        resolved = rospy.resolve_name(name)
        uri = provider(resolved)
        if uri is not None and alive(resolved, uri):
            raise MiddlewareError(
                f"service {resolved} is offered by another node already",
                expected="one node of that name: end the other, or start this one with __name:=another_name",
            )
        self._server = rospy.Service(name, self._interface, self.answer)
        is_slow = service.prepare is not None and not service.quick
        if is_slow:
            rate = Rate(2.0, 4)
        elif service.urgent or service.quick:
            rate = Rate(*QUICK_LIMIT)
        else:
            rate = REQUESTS
        busy = _Instead(f"too many requests: its turn does not come within {RATE_TIMEOUT:g} s")

        def too_large(size: int) -> _Instead:
            return _Instead(f"a request of {size} bytes (expected: {service.largest} bytes at most)")

        bound_requests(self._server.protocol, service.largest, rate, instead=too_large, busy=busy)

    def close(self) -> None:
        """Unregister."""
        self._server.shutdown()

    def _match(self, declared: type, ros_class: type[Any], what: str, name: str) -> None:
        fields = {field.name for field in dataclasses.fields(declared)}
        expected = set(ros_class.__slots__)
        if what == "reply":
            expected |= {"success", "message"}
        if fields != expected:
            raise ComponentError(
                f"the {what} {declared.__name__} of service {name} has fields {', '.join(sorted(fields))}",
                expected=f"those of {self._service.interface}: {', '.join(sorted(expected))}",
            )

    def answer(self, request: Any) -> Any:
        """Carry out a request of the ROS class, and return the response."""
        if isinstance(request, _Instead):
            return self._refuse(request.reason)
        if not self._running():
            return self._refuse(f"{self._owner} ends", later=True)
        fields = {name: plain(getattr(request, name)) for name in request.__slots__}
        future: Future[Any] = Future()
        try:
            for left in reversed(range(3)):  # others may overtake it, in whose threads they are prepared
                future = self._submit(self._service.prepared(self._service.request(**fields)))
                try:
                    reply = future.result(self._service.timeout)
                    break
                except Overtaken:
                    if not left:
                        raise
            values = {field.name: getattr(reply, field.name) for field in dataclasses.fields(reply)}
        except SolferError as error:
            return self._refuse(described(error, lines=True))
        except (FutureTimeout, CancelledError):
            future.cancel()
            reason = f"no answer of its loop within {self._service.timeout:g} s"
            return self._refuse(f"{self._owner} does not run: {reason}", later=True)
        except BaseException as error:  # no signal comes to this thread
            logger.exception("service %s/%s fails", self._owner, self._service.name)
            return self._refuse(located(error))
        self.done()
        return self._interface._response_class(**values)

    def _refuse(self, message: str, later: bool = False) -> Any:
        """Return a response without success; `later`: nothing is wrong with the request, it may be repeated."""
        response = self._interface._response_class(success=False, message=message)
        if hasattr(response, "later"):
            response.later = later
        return response
