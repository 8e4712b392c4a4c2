"""Calls of services, and the nodes that offer them."""

import dataclasses
import functools
import socket
import time
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy

from solfer.errors import MiddlewareError, ServiceUnavailable, nearest
from solfer.middleware.ros.codecs.interfaces import service_class
from solfer.transport.threaded_calls import as_fields, in_thread
from solfer.transport.waiting import CHECK_PERIOD, wait_for


def provider(resolved: str) -> str | None:
    """Look up the URI of the node that offers a service, None if there is none.

    Raises:
        MiddlewareError: The master does not answer.
    """
    try:
        return rosgraph.Master(rospy.get_name()).lookupService(resolved)
    except rosgraph.MasterError:
        return None
    except OSError as error:
        raise MiddlewareError(
            f"the ROS master does not answer any more: {error}", expected="a running master (roscore) at ROS_MASTER_URI"
        ) from error


def alive(resolved: str, uri: str) -> bool:
    """Check whether a registered service is really there; a killed node leaves its registration behind."""
    probe = {"probe": "1", "md5sum": "*", "callerid": rospy.get_name(), "service": resolved}
    try:
        with socket.create_connection(rospy.core.parse_rosrpc_uri(uri), timeout=0.5) as connection:
            rosgraph.network.write_ros_handshake_header(connection, probe)
    except OSError:
        return False
    return True


def call(name: str, interface: str, request: Any, timeout: float, running: Callable[[], bool]) -> Any:
    """Call a service as soon as it is there.

    Args:
        name: Name of the service.
        interface: Its type, `package/Type`.
        request: Dataclass with the fields of the type's request.
        timeout: Longest time until the reply [s].
        running: False when the node has to end.

    Returns:
        The response, of the type's class.

    Raises:
        ServiceUnavailable: There was no such service within `timeout`.
        MiddlewareError: There was no reply within `timeout`.
        ShutdownRequested: The node has to end.
    """
    resolved = rospy.resolve_name(name)
    ros_class = service_class(interface)
    end = time.monotonic() + timeout
    failure = ""
    while wait_for(functools.partial(provider, resolved), end - time.monotonic(), running):
        proxy = rospy.ServiceProxy(resolved, ros_class)
        sent = ros_class._request_class(**as_fields(request))
        reply = in_thread(functools.partial(proxy, sent))  # rospy's call has no timeout
        if not wait_for(reply.done, end - time.monotonic(), running):
            failure = "does not answer"
            break
        if reply.exception() is None:
            return reply.result()
        failure = f"fails: {reply.exception()}"
        if time.monotonic() >= end:
            break
        time.sleep(CHECK_PERIOD)
    if failure:
        raise MiddlewareError(
            f"service {resolved} {failure} (waited {timeout:g} s)", expected="a node that offers it and runs"
        )
    raise ServiceUnavailable(
        f"service {resolved} is offered by no node (waited {timeout:g} s)", names=nearest(resolved, _alike(resolved))
    )


def _alike(resolved: str) -> list[str]:
    """List all services with the same last part of the name."""
    ending = resolved[resolved.rindex("/") :]
    try:
        _, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    except (rosgraph.MasterException, OSError):
        return []
    return [name for name, _ in services if name.endswith(ending)]


def replied(response: Any, reply: type) -> Any:
    """Convert a response of ROS to the dataclass `reply`."""
    return reply(**{field.name: plain(getattr(response, field.name)) for field in dataclasses.fields(reply)})


def plain(value: Any) -> Any:
    """Convert a field of a ROS message to what dataclasses hold: lists to tuples."""
    return tuple(value) if isinstance(value, list) else value
