"""Services that components declare, as ROS services."""

from collections.abc import Callable
from typing import Any

import rospy

from solfer.errors import MiddlewareError
from solfer.interfaces.declaration import Service
from solfer.middleware.ros.calls import alive, plain, provider
from solfer.middleware.ros.codecs.bounded import RATE_TIMEOUT, Rate, bound_requests
from solfer.middleware.ros.codecs.interfaces import service_class
from solfer.transport.middleware import Submit
from solfer.transport.threaded_calls import ThreadedService, refusal

REQUESTS = Rate(500.0, 50)
"""Requests that this node decodes, in a second and at once."""

QUICK_LIMIT = (100.0, 20)
"""The same for each service that is urgent or quick."""


class _Instead:
    """Stands in for a request that is not decoded; rospy sets an attribute."""

    def __init__(self, reason: str):
        self.reason = reason


class RosService(ThreadedService):
    """A declared service under a ROS name; a request waits in rospy's thread.

    Args:
        owner: Name of the part that offers it; the service's name is `<owner>/<name>`.
        service: The declaration.
        submit: Passes calls to the loop.
        running: False when the node has to end.

    Raises:
        ComponentError: The dataclasses of the declaration differ from the service type.
        MiddlewareError: Another node offers a service of that name.
    """

    def __init__(self, owner: str, service: Service, submit: Submit, running: Callable[[], bool]):
        super().__init__(owner, service, submit, running)
        self._interface = service_class(service.interface)
        self.match(set(self._interface._request_class.__slots__), set(self._interface._response_class.__slots__))
        resolved = rospy.resolve_name(self.name)
        uri = provider(resolved)
        if uri is not None and alive(resolved, uri):
            raise MiddlewareError(
                f"service {resolved} is offered by another node already",
                expected="one node of that name: end the other, or start this one with __name:=another_name",
            )
        self._server = rospy.Service(self.name, self._interface, self.answer)
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

    def answer(self, request: Any) -> Any:
        """Carry out a request of the ROS class, and return the response."""
        if isinstance(request, _Instead):
            reply = refusal(request.reason)
        else:
            reply = self.carry_out({name: plain(getattr(request, name)) for name in request.__slots__})
        ros_class = self._interface._response_class
        return ros_class(**{name: reply[name] for name in ros_class.__slots__ if name in reply})
