"""The ROS master: whether it answers, whether a node is there already, and which nodes it knows."""

import http.client
import socket
import xmlrpc.client
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import rosgraph

from solfer.errors import MiddlewareError

CALL_TIMEOUT = 2.0
"""Longest time for an answer of the master or of a node [s]."""

CALLER = "/solfer"
"""Name of the caller, as long as there is no node."""

UNREACHABLE = (OSError, ValueError, xmlrpc.client.Error, http.client.HTTPException)
"""What can go wrong on the way to a master or a node."""


@dataclass(frozen=True)
class Graph:
    """The nodes that the master knows.

    Attributes:
        publishers: Nodes that publish a topic, by its name.
        subscribers: Nodes that subscribe to it.
        types: Type of the messages on a topic; that of its publishers, if there are any.
    """

    publishers: Mapping[str, list[str]]
    subscribers: Mapping[str, list[str]]
    types: Mapping[str, str]


class _Bounded(xmlrpc.client.Transport):
    """A connection to a server that waits for no operation of the network longer than CALL_TIMEOUT."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = CALL_TIMEOUT
        return connection


def call(uri: str, method: str, *arguments: Any) -> Any:
    """Call a method of a master or a node.

    Raises:
        MasterError: It answers that it cannot.
        OSError, ValueError, xmlrpc.client.Error, HTTPException: It does not answer; see UNREACHABLE.
    """
    with xmlrpc.client.ServerProxy(uri, _Bounded()) as server:
        code, text, value = getattr(server, method)(CALLER, *arguments)
    if code != 1:
        raise rosgraph.MasterError(text)
    return value


def call_master(method: str, *arguments: Any) -> Any:
    """Call a method of the master.

    Raises:
        MasterError: It answers that it cannot.
        MiddlewareError: It does not answer; names its URI.
    """
    uri = rosgraph.get_master_uri()
    try:
        return call(rosgraph.Master(CALLER).master_uri, method, *arguments)  # which checks the URI
    except UNREACHABLE as error:
        raise MiddlewareError(
            f"the ROS master does not answer ({error})",
            where=str(uri),
            expected="a running master: start roscore or roslaunch, or set ROS_MASTER_URI",
        ) from error


def require_master() -> int:
    """Make sure that the master answers.

    Returns:
        Number of its process.

    Raises:
        MiddlewareError: It does not; names its URI.
    """
    return call_master("getPid")


def knows(node: str, uri: str) -> bool:
    """Return whether the master knows a node at this URI.

    Raises:
        MiddlewareError: The master does not answer.
    """
    try:
        return call_master("lookupNode", node) == uri
    except rosgraph.MasterError:
        return False


def lives(uri: str, process: int) -> bool:
    """Return whether the node of a process still answers at its URI; one that hangs does."""
    try:
        return call(uri, "getPid") == process
    except TimeoutError:
        return True
    except (*UNREACHABLE, rosgraph.MasterError):
        return False


def graph() -> Graph:
    """Look up the nodes that the master knows at present.

    Raises:
        MiddlewareError: The master does not answer.
    """
    publishers, subscribers, _ = call_master("getSystemState")
    return Graph(dict(publishers), dict(subscribers), dict(call_master("getTopicTypes")))


def subscribed_type(node: str, topic: str) -> str:
    """Request from a node the type of the messages that it expects on a topic; empty if it does not answer."""
    try:
        return dict(call(call_master("lookupNode", node), "getSubscriptions")).get(topic, "")
    except (*UNREACHABLE, rosgraph.MasterError, MiddlewareError):
        return ""


def refuse_twin(resolved: str) -> None:
    """Make sure that no living node has this name: the master would shut it down in favour of the new one.

    Raises:
        MiddlewareError: There is one.
    """
    try:
        call(call_master("lookupNode", resolved), "getPid")
    except (rosgraph.MasterError, ConnectionError, socket.gaierror):
        return
    except OSError:
        # It accepts connections and does not answer: it hangs, or its machine is not reachable at present.
        raise _twin(resolved, "is registered and does not answer", f"rosnode kill {resolved}, or") from None
    raise _twin(resolved, "is running already", "")


def _twin(resolved: str, state: str, cure: str) -> MiddlewareError:
    return MiddlewareError(
        f"a node {resolved} {state}; a second one of the same name would end it",
        expected=f"{cure} another name by __name:=NAME".strip(),
    )


def _answers(node: str) -> bool:
    """Return whether a node that the master knows lives; one that hangs does."""
    try:
        call(call_master("lookupNode", node), "getPid")
    except (rosgraph.MasterError, ConnectionError, socket.gaierror):
        return False
    except OSError:
        return True
    return True


def refuse_second(topic: str, own: str) -> None:
    """Make sure that no living node was there first with a topic that has one publisher.

    Of nodes that start in the same moment the one stays that the master registered first.

    Args:
        topic: The topic, with which this node is registered.
        own: Name of this node.

    Raises:
        MiddlewareError: There is one, or the master does not answer.
    """
    publishers = graph().publishers.get(topic, [])  # in the order of their registration
    for other in publishers[: publishers.index(own)] if own in publishers else publishers:
        if _answers(other):
            raise MiddlewareError(
                f"{other} publishes {topic} already",
                expected="one node that simulates where /use_sim_time is true: "
                f"rosnode kill {other}, or rosparam set /use_sim_time false",
            )
