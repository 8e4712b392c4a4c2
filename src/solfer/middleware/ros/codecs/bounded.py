"""Bounds what comes in over a connection of rospy before it is decoded, or even kept.

rospy reads, keeps and decodes whatever size a sender announces, as fast as it comes, in a thread for each connection.
"""

import threading
import time
from collections.abc import Callable
from io import BytesIO
from typing import Any

from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransportProtocol

from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH

RATE_TIMEOUT = 1.0
"""Longest time that a request waits until the rate allows it [s]."""

Instead = Callable[[int], Any]
"""Returns what replaces a message of that size in bytes; None: nothing."""


class Rate:
    """Limits the rate of calls from several threads, after a burst.

    Args:
        rate: Calls in a second.
        burst: Calls that pass at once.
    """

    def __init__(self, rate: float, burst: int):
        self._period = 1.0 / rate
        self._ahead = burst / rate
        self._next = 0.0
        self._lock = threading.Lock()

    def wait(self, timeout: float = RATE_TIMEOUT) -> bool:
        """Wait until the rate allows a call; returns False, at once, if that takes longer than `timeout` [s]."""
        with self._lock:
            now = time.monotonic()
            start = max(self._next, now - self._ahead)
            if start - now > timeout:
                return False
            self._next = start + self._period
        if start > now:
            time.sleep(start - now)
        return True


def bound_messages(protocol: TCPROSTransportProtocol, largest: int, instead: Instead) -> None:
    """Limit a topic's connection to messages of `largest` bytes, and let it rest when too many come."""
    read = _bounded(protocol, largest, instead)

    def read_messages(buffer: BytesIO, queue: list[Any], sock: Any) -> None:
        read(buffer, queue, sock)
        if len(queue) > 16:
            time.sleep(200e-6 * len(queue))

    protocol.read_messages = read_messages


def bound_requests(protocol: TCPROSTransportProtocol, largest: int, rate: Rate, instead: Instead, busy: Any) -> None:
    """Limit a service's connections to requests of `largest` bytes, and the rate at which they are decoded.

    Args:
        protocol: The service's.
        largest: Bytes of a request.
        rate: Limit of the rate.
        instead: Returns what replaces a request that is too large.
        busy: Replaces a request that would wait too long.
    """
    read = _bounded(protocol, largest, instead)

    def read_messages(buffer: BytesIO, queue: list[Any], sock: Any) -> None:
        size = _announced(buffer)
        if size <= largest and buffer.tell() >= MESSAGE_LENGTH.size + size and not rate.wait():
            _skip(buffer, sock, size)
            queue.append(busy)
            return
        read(buffer, queue, sock)

    protocol.read_messages = read_messages


def _bounded(protocol: TCPROSTransportProtocol, largest: int, instead: Instead) -> Callable[..., None]:
    read = protocol.read_messages
    protocol.buff_size = max(4096, min(protocol.buff_size, MESSAGE_LENGTH.size + largest))

    def read_messages(buffer: BytesIO, queue: list[Any], sock: Any) -> None:
        size = _announced(buffer)
        if size <= largest:
            read(buffer, queue, sock)
            return
        if size > 2**26:  # the connection is closed instead of being read to the message's end
            raise TransportTerminated(f"a message of {size} bytes")
        _skip(buffer, sock, size)
        found = instead(size)
        if found is not None:
            queue.append(found)

    return read_messages


def _announced(buffer: BytesIO) -> int:
    """Read the size of the message that begins in a buffer, which holds 4 bytes or more [bytes]."""
    with buffer.getbuffer() as view:
        return MESSAGE_LENGTH.unpack_from(view)[0]


def _skip(buffer: BytesIO, sock: Any, size: int) -> None:
    """Skip a message, as far as it is there and as far as it is still to come."""
    whole = MESSAGE_LENGTH.size + size
    rest = buffer.getvalue()[whole : buffer.tell()]
    left = whole - buffer.tell()
    buffer.seek(0)
    buffer.truncate(0)
    buffer.write(rest)
    most = 65536  # bytes that are thrown away at once
    scratch = bytearray(min(max(left, 0), most))
    while left > 0:
        got = sock.recv_into(scratch, min(left, most))
        if not got:
            raise TransportTerminated("the sender has ended in the middle of a message")
        left -= got
