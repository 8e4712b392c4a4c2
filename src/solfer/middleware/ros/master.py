"""The ROS master: whether it answers, and whether a node is there already."""

import contextlib
import http.client
import socket
import xmlrpc.client
from collections.abc import Iterator

import rosgraph

from solfer.errors import MiddlewareError

TIMEOUT = 2.0
"""Longest time for an answer of the master or of a node [s]."""


def require_master() -> int:
    """Make sure that the master answers.

    Returns:
        Number of its process.

    Raises:
        MiddlewareError: It does not; names its URI.
    """
    uri = rosgraph.get_master_uri()
    try:
        with _bounded():
            return rosgraph.Master("/solfer").getPid()
    except (OSError, ValueError, rosgraph.MasterException, xmlrpc.client.Error, http.client.HTTPException) as error:
        raise MiddlewareError(
            f"the ROS master does not answer ({error})",
            where=str(uri),
            expected="a running master: start roscore or roslaunch, or set ROS_MASTER_URI",
        ) from error


def refuse_twin(resolved: str) -> None:
    """Make sure that no living node has this name: the master would shut it down in favour of the new one.

    Raises:
        MiddlewareError: There is one.
    """
    try:
        with _bounded():
            uri = rosgraph.Master("/solfer").lookupNode(resolved)
            xmlrpc.client.ServerProxy(uri).getPid(resolved)
    except (rosgraph.MasterError, ConnectionError, socket.gaierror):
        return
    except OSError:
        # It accepts connections and says nothing: it hangs, or its machine is not reachable at present.
        raise _twin(resolved, "is registered and does not answer", f"rosnode kill {resolved}, or") from None
    raise _twin(resolved, "is running already", "")


def _twin(resolved: str, state: str, cure: str) -> MiddlewareError:
    return MiddlewareError(
        f"a node {resolved} {state}; a second one of the same name would end it",
        expected=f"{cure} another name by __name:=NAME".strip(),
    )


@contextlib.contextmanager
def _bounded() -> Iterator[None]:
    """Limit the time of each network operation: the XML-RPC client has no other way."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(TIMEOUT)
    try:
        yield
    finally:
        socket.setdefaulttimeout(before)
