"""Services that components declare, as ROS services."""

import dataclasses
import logging
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

import rospy

from solfer.components import Service
from solfer.errors import ComponentError, MiddlewareError, SolferError
from solfer.middleware.ros.calls import alive, provider
from solfer.middleware.ros.interfaces import service_class
from solfer.pipes.middleware import Submit

logger = logging.getLogger(__name__)

class RosService:
    """A declared service under a ROS name.

    A request waits in rospy's thread until the loop has carried it out between two cycles. Whatever goes wrong is told
    to the caller: `success` false, and a message.

    Args:
        owner: Who offers it; the service's name is `<owner>/<name>`.
        service: The declaration.
        submit: Takes calls to the loop.
        running: False when the node was asked to end.

    Raises:
        ComponentError: The dataclasses of the declaration differ from the service type.
        MiddlewareError: Another node offers a service of that name.
    """

    def __init__(self, owner: str, service: Service, submit: Submit, running: Callable[[], bool]):
        self._owner, self._service, self._submit, self._running = owner, service, submit, running
        self._interface = service_class(service.interface)
        name = f"{owner}/{service.name}"
        self._match(service.request, self._interface._request_class, "request", name)
        self._match(service.reply, self._interface._response_class, "reply", name)
        resolved = rospy.resolve_name(name)
        uri = provider(resolved)
        if uri is not None and alive(resolved, uri):
            raise MiddlewareError(f"service {resolved} is offered by another node already")
        self._server = rospy.Service(name, self._interface, self._answer)

    def close(self) -> None:
        """Unregister."""
        self._server.shutdown()

    def _match(self, declared: type, ros_class: type, what: str, name: str) -> None:
        fields = {field.name for field in dataclasses.fields(declared)}
        expected = set(ros_class.__slots__)
        if what == "reply":
            expected |= {"success", "message"}
        if fields != expected:
            raise ComponentError(
                f"the {what} {declared.__name__} of service {name} has fields {', '.join(sorted(fields))}",
                expected=f"those of {self._service.interface}: {', '.join(sorted(expected))}",
            )

    def _answer(self, request: Any) -> Any:
        if not self._running():
            return self._refuse(f"{self._owner} ends")
        fields = {name: plain(getattr(request, name)) for name in request.__slots__}
        future: Future[Any] = Future()
        try:
            future = self._submit(self._service.prepared(self._service.request(**fields)))
            reply = future.result(self._service.timeout)
        except SolferError as error:
            return self._refuse(str(error))
        except (FutureTimeout, CancelledError):
            future.cancel()
            return self._refuse(f"{self._owner} does not run: no answer of its loop within {self._service.timeout:g} s")
        except Exception as error:
            logger.exception("service %s/%s fails", self._owner, self._service.name)
            return self._refuse(f"{type(error).__name__}: {error}")
        values = {field.name: getattr(reply, field.name) for field in dataclasses.fields(reply)}
        return self._interface._response_class(**values)

    def _refuse(self, message: str) -> Any:
        return self._interface._response_class(success=False, message=message)


def plain(value: Any) -> Any:
    """A field of a ROS message as dataclasses hold it: lists as tuples."""
    return tuple(value) if isinstance(value, list) else value
