"""Services: those that components declare, and calls of others'."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from solfer.errors import MiddlewareError, ServiceUnavailable, nearest
from solfer.interfaces.declaration import Service
from solfer.middleware.ros2.codecs import filled, interface, plain
from solfer.transport.middleware import Submit
from solfer.transport.threaded_calls import ThreadedService, as_fields

CHECK_PERIOD = 0.02
"""Time between two looks for a service [s]."""


class Ros2Service(ThreadedService):
    """A declared service under a ROS name; a request waits in a thread of the executor.

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
        super().__init__(owner, service, submit, running)
        self._node = node
        kind = interface(service.interface, "srv")
        self.match(_fields(kind.Request), _fields(kind.Response))
        name = node.resolve_service_name(self.name)
        if node.count_services(name):
            raise MiddlewareError(
                f"service {name} is offered by another node already",
                expected="one node of that name: end the other, or add `--ros-args -r __node:=another_name`",
            )
        self._server = node.create_service(kind, name, self.answer, callback_group=ReentrantCallbackGroup())

    def close(self) -> None:
        """Withdraw it."""
        self._node.destroy_service(self._server)

    def answer(self, request: Any, response: Any) -> Any:
        """Carry out a request of the ROS class, and return the response."""
        fields = {name: plain(getattr(request, name)) for name in _fields(type(request))}
        return filled(type(response), self.carry_out(fields))


def call(node: Node, name: str, kind: str, request: Any, *, timeout: float, running: Callable[[], bool]) -> Any:
    """Call a service as soon as it is there, and return its response.

    Raises:
        ServiceUnavailable: There was no such service within `timeout` [s].
        MiddlewareError: There was no reply within `timeout`, or the node has to end.
    """
    ros_class = interface(kind, "srv")
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
        reply = client.call_async(filled(ros_class.Request, as_fields(request)))
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
