"""Bounds what strangers may send to the ports of a rospy node: rospy waits for it and keeps it without a limit."""

import functools
import logging
import socket
import struct
import threading
import time
from collections.abc import Callable
from io import BytesIO
from typing import Any

import rosgraph.xmlrpc
from rosgraph.network import ROSHandshakeException, decode_ros_handshake_header
from rospy.impl import tcpros_base
from rospy.impl.registration import RegManager

from solfer.throttle import Throttle

logger = logging.getLogger(__name__)

LARGEST_CALL = 2**20
"""Bytes of an XML-RPC call."""

LARGEST_HEADER = 2**16
"""Bytes of the header of a connection."""

TIMEOUT = 10.0
"""Longest time that a caller may be silent, and that the header of a connection takes [s]."""

CALLERS = 128
"""Connections of callers at the same time."""

ADDRESSES = 256
"""Publishers that are called at the same time."""

_throttle = Throttle(logger)


class BoundedCalls(rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler):
    """Answers XML-RPC calls of a bounded size."""

    timeout = TIMEOUT

    def do_POST(self) -> None:  # noqa: N802 the name is that of the base class
        """Answer a call."""
        length = self.headers.get("content-length", "")
        if not (length.isascii() and length.isdigit() and len(length) < 10 and int(length) <= LARGEST_CALL):
            _throttle.warning("call", "a call of %.20s bytes is refused: %d bytes at most", length, LARGEST_CALL)
            self.close_connection = True
            self.send_error(413)
            return
        super().do_POST()


class BoundedCallServer(rosgraph.xmlrpc.ThreadingXMLRPCServer):
    """Serves a bounded number of connections at the same time."""

    def __init__(self, *given: Any) -> None:
        self._callers = threading.Semaphore(CALLERS)
        super().__init__(*given)
        self.RequestHandlerClass = BoundedCalls

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection in a thread of its own."""
        if self._callers.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            _throttle.warning("callers", "a connection is refused: %d callers at most", CALLERS)
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._callers.release()


def bound_ports() -> None:
    """Bound the ports of the node that this process is about to start."""
    if rosgraph.xmlrpc.ThreadingXMLRPCServer is BoundedCallServer:
        return
    rosgraph.xmlrpc.ThreadingXMLRPCServer = BoundedCallServer
    server = tcpros_base.TCPROSServer
    server._tcp_server_callback = _in_threads(server._tcp_server_callback, most=64)
    tcpros_base.TCPServer.run = _until_shutdown(tcpros_base.TCPServer.run)
    tcpros_base.read_ros_handshake_header = read_header
    tcpros_base.logwarn = lambda text, *values: _throttle.warning("port", "%.300s", text % values if values else text)
    RegManager.publisher_update = _once(RegManager.publisher_update)
    RegManager._connect_topic_thread = _limited(RegManager._connect_topic_thread, threading.Semaphore(ADDRESSES))


def read_header(sock: socket.socket, buffer: BytesIO, size: int) -> dict[str, str]:
    """Read the header of a connection, and nothing behind it.

    Raises:
        ROSHandshakeException: It is too large, is no header, or does not come in time.
    """
    before = sock.gettimeout()
    end = time.monotonic() + TIMEOUT
    try:
        head = _received(sock, 4, end)
        (length,) = struct.unpack("<I", head)
        if length > LARGEST_HEADER:
            raise ROSHandshakeException(f"a header of {length} bytes: {LARGEST_HEADER} bytes at most")
        return decode_ros_handshake_header(head + _received(sock, length, end))
    except (TimeoutError, ValueError, struct.error) as error:
        raise ROSHandshakeException(f"no header: {error}") from error
    finally:
        sock.settimeout(before)


def _received(sock: socket.socket, count: int, end: float) -> bytes:
    """Receive so many bytes until a time [s]."""
    content = bytearray()
    while len(content) < count:
        sock.settimeout(max(end - time.monotonic(), 1e-3))
        part = sock.recv(count - len(content))
        if not part:
            raise ROSHandshakeException("the connection has ended before its header")
        content += part
    return bytes(content)


def _limited(function: Callable[..., None], free: threading.Semaphore) -> Callable[..., None]:
    """Leave out calls while others fill the limit."""

    @functools.wraps(function)
    def call(*given: Any) -> None:
        if not free.acquire(blocking=False):
            _throttle.warning("address", "a publisher is not called: %d at the same time at most", ADDRESSES)
            return
        try:
            function(*given)
        finally:
            free.release()

    return call


def _in_threads(accepted: Callable[..., None], most: int) -> Callable[..., None]:
    """Handle each connection in a thread: one that is silent stops no other one."""
    free = threading.Semaphore(most)

    @functools.wraps(accepted)
    def handle(self: Any, sock: socket.socket, address: Any) -> None:
        def run() -> None:
            try:
                accepted(self, sock, address)
            finally:
                free.release()

        if not free.acquire(blocking=False):
            _throttle.warning("connection", "a connection is refused: %d wait for their headers already", most)
            sock.close()
            return
        threading.Thread(target=run, daemon=True).start()

    return handle


def _until_shutdown(run: Callable[[Any], None]) -> Callable[[Any], None]:
    """Accept connections again after an error, such as too many open files."""

    @functools.wraps(run)
    def run_on(self: Any) -> None:
        while True:
            try:
                return run(self)
            except OSError as error:
                _throttle.warning("accept", "no connection can be accepted: %s", error)
            time.sleep(0.1)  # until the process may have a descriptor left
            if self.is_shutdown:
                return

    return run_on


def _once(update: Callable[..., None]) -> Callable[..., None]:
    """Take over a list of publishers once, of a bounded length: rospy does so once for each of them."""

    @functools.wraps(update)
    def update_once(self: Any, name: str, uris: list[str]) -> None:
        if len(uris) > ADDRESSES:
            _throttle.warning("uris", "%d publishers of %.100s are refused: %d at most", len(uris), name, ADDRESSES)
        elif not self.updates or self.updates[-1] != (name, uris):
            update(self, name, uris)

    return update_once
