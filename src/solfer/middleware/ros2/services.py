"""Services: those that components declare, and calls of others'."""

import dataclasses
import logging
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from solfer.errors import (
    ComponentError,
    MiddlewareError,
    Overtaken,
    ServiceUnavailable,
    SolferError,
    described,
    located,
    nearest,
)
from solfer.interfaces.declaration import Service
from solfer.middleware.ros2.codecs import filled, interface, plain
from solfer.transport.middleware import Submit

logger = logging.getLogger(__name__)

CHECK_PERIOD = 0.02
"""Time between two looks for a service [s]."""


class Ros2Service:
    """A declared service under a ROS name.

    A request waits in a thread of the executor until the loop has carried it out between two cycles. Every failure is
    returned to the caller: `success` false, and a message.

    Args:
        node: The node that offers it.
        owner: Name of the part that offers it; the service's name is `<owner>/<name>`.
        service: The declaration.
        submit: Passes calls to the loop.
        running: False when the node has to end.

    Raises:
        ComponentError: The dataclasses of the declaration differ from the service type.
        MiddlewareError: Another node offers a service of that name.
    """

    def __init__(self, node: Node, owner: str, service: Service, submit: Submit, running: Callable[[], bool]):
        self._node = node
        self._owner = owner
        self._service = service
        self._submit = submit
        self._running = running
        kind = interface(service.interface, "srv")
        self._match(service.request, kind.Request, more=frozenset())
        self._match(service.reply, kind.Response, more=frozenset(("success", "message")))
        name = node.resolve_service_name(f"{owner}/{service.name}")
        if node.count_services(name):
            raise MiddlewareError(
                f"service {name} is offered by another node already",
                expected="one node of that name: end the other, or add `--ros-args -r __node:=another_name`",
            )
        self._server = node.create_service(kind, name, self.answer, callback_group=ReentrantCallbackGroup())

    def close(self) -> None:
        """Withdraw it."""
        self._node.destroy_service(self._server)

    def _match(self, declared: type, ros_class: Any, more: frozenset[str]) -> None:
        fields = {field.name for field in dataclasses.fields(declared)}
        expected = _fields(ros_class) | more
        if fields != expected:
            name = f"{self._owner}/{self._service.name}"
            raise ComponentError(
                f"{declared.__name__} of service {name} has fields {', '.join(sorted(fields))}",
                expected=f"those of {self._service.interface}: {', '.join(sorted(expected))}",
            )

    def answer(self, request: Any, response: Any) -> Any:
        """Carry out a request of the ROS class, and fill the response."""
        if not self._running():
            return self._refuse(response, f"{self._owner} ends", later=True)
        future: Future[Any] = Future()
        fields = {name: plain(getattr(request, name)) for name in _fields(type(request))}
        try:
            for left in reversed(range(3)):  # others may overtake it, in whose threads they are prepared
                future = self._submit(self._service.prepared(self._service.request(**fields)))
                try:
                    reply = future.result(self._service.timeout)
                    break
                except Overtaken:
                    if not left:
                        raise
        except SolferError as error:
            return self._refuse(response, described(error, lines=True))
        except (FutureTimeout, CancelledError):
            future.cancel()
            reason = f"no answer of its loop within {self._service.timeout:g} s"
            return self._refuse(response, f"{self._owner} does not run: {reason}", later=True)
        except BaseException as error:  # no signal comes to this thread
            logger.exception("service %s/%s fails", self._owner, self._service.name)
            return self._refuse(response, located(error))
        return filled(type(response), {field.name: getattr(reply, field.name) for field in dataclasses.fields(reply)})

    def _refuse(self, response: Any, message: str, later: bool = False) -> Any:
        """Return a response without success; `later`: nothing is wrong with the request, it may be repeated."""
        response.success = False
        response.message = message
        if hasattr(response, "later"):
            response.later = later
        return response


def call(node: Node, name: str, kind: str, request: Any, *, timeout: float, running: Callable[[], bool]) -> Any:
    """Call a service as soon as it is there, and return its response.

    Raises:
        ServiceUnavailable: There was no such service within `timeout` [s].
        MiddlewareError: There was no reply within `timeout`, or the node has to end.
    """
    ros_class = interface(kind, "srv")
    values = {field.name: getattr(request, field.name) for field in dataclasses.fields(request)}
    client = node.create_client(ros_class, name, callback_group=ReentrantCallbackGroup())
    end = time.monotonic() + timeout
    resolved = client.service_name
    try:
        if not _wait(client.service_is_ready, end, running):
            present = [each for each, _ in node.get_service_names_and_types()]
            alike = [each for each in present if each.rpartition("/")[2] == resolved.rpartition("/")[2]]
            raise ServiceUnavailable(
                f"service {resolved} is offered by no node (waited {timeout:g} s)", names=nearest(resolved, alike)
            )
        reply = client.call_async(filled(ros_class.Request, values))
        if not _wait(reply.done, end, running, period=0.001):
            raise MiddlewareError(
                f"service {resolved} does not answer (waited {timeout:g} s)", expected="a node that offers it and runs"
            )
        return reply.result()
    finally:
        node.destroy_client(client)


def replied(response: Any, reply: type) -> Any:
    """Convert a response of ROS to the dataclass `reply`."""
    return reply(**{field.name: plain(getattr(response, field.name)) for field in dataclasses.fields(reply)})


def _fields(ros_class: Any) -> set[str]:
    return {name for name in ros_class.get_fields_and_field_types() if name != "structure_needs_at_least_one_member"}


def _wait(condition: Callable[[], bool], end: float, running: Callable[[], bool], period: float = CHECK_PERIOD) -> bool:
    while not condition():
        if time.monotonic() >= end or not running():
            return False
        time.sleep(period)
    return True
