"""A topic to send packed messages on, from the thread that makes them.

rospy's own queue gives each subscriber a sending thread, which costs more than the sending, and its sending without a
queue waits for a subscriber that hangs. Here the bytes of a message go straight to the operating system, which never
waits.
"""

import socket
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

import rospy
from rospy.impl.tcpros_base import TCPROSTransport

from solfer.errors import MiddlewareError
from solfer.middleware.ros.codecs.packed_message import PackedMessage

SEND_FLAGS = socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL


@dataclass
class SendBacklog:
    """What a subscriber that reads too slowly has not received yet.

    Attributes:
        rest: End of a message that is in progress already; it has to come first.
        newest: The newest message of each publisher, of which nothing is in progress.
    """

    rest: bytes = b""
    newest: dict["TopicPublisher", bytes] = field(default_factory=dict)

    @property
    def waiting(self) -> bytes:
        """All of it."""
        return b"".join((self.rest, *self.newest.values()))

    def subtract(self, count: int) -> None:
        """Forget the first `count` bytes: they are in progress."""
        before = len(self.rest)
        self.rest = self.rest[count:]
        count -= before
        while count > 0:
            message = self.newest.pop(next(iter(self.newest)))
            self.rest = message[count:]
            count = count - len(message)


Backlogs = dict[TCPROSTransport, SendBacklog]

_backlogs: "WeakKeyDictionary[Any, Backlogs]" = WeakKeyDictionary()
"""The backlogs of each topic of this process: several publishers of it, one of each component, share its connections,
so that none may send while half a message of another one is in progress."""


class TopicPublisher:
    """A topic to send packed messages on; only one thread may send, also where a process has several of a topic.

    A subscriber that hangs or is slow loses messages, all others get them: of those that do not fit into its socket's
    buffer any more only the newest is kept, and sent with the next one or by `flush`.

    Args:
        topic: Name of the topic.
        ros_class: Class of the messages.
        latch: Whether rospy sends the newest message of `latch` to later subscribers.

    Attributes:
        topic: Resolved name.
    """

    def __init__(self, topic: str, ros_class: type, latch: bool = False):
        self._publisher = rospy.Publisher(topic, ros_class, queue_size=1, tcp_nodelay=True, latch=latch)
        self._implementation = self._publisher.impl
        self._implementation.set_queue_size(None)  # no sending threads
        self._backlogs = _backlogs.setdefault(self._implementation, {})
        self.topic = self._publisher.resolved_name

    def has_subscribers(self) -> bool:
        """Return whether there are subscribers.

        Raises:
            MiddlewareError: The topic was closed.
        """
        if self._publisher.impl is None:
            raise MiddlewareError(f"topic '{self.topic}' is closed", expected="a publisher that was not closed")
        return bool(self._implementation.connections)

    def number(self) -> int:
        """Return the number of the newest message that was sent; zero before the first."""
        return self._implementation.seq

    def receivers(self) -> set[str]:
        """Return the names of the nodes that are connected."""
        return {connection.endpoint_id for connection in self._implementation.connections}

    def send(self, frame: PackedMessage) -> None:
        """Send a message with its number to all subscribers; without any, it is not counted.

        Raises:
            MiddlewareError: The topic was closed.
        """
        if not self.has_subscribers():
            return
        implementation = self._implementation
        data = frame.bytes
        implementation.seq += 1
        frame.number(implementation.seq)
        implementation.message_data_sent += len(data)
        for connection in implementation.connections:
            if connection in self._backlogs:
                self._backlogs[connection].newest[self] = bytes(data)
                self._push(connection)
            elif (sent := _send(connection, data)) < len(data):
                self._keep(connection, bytes(data), sent)

    def latch(self, message: rospy.Message) -> None:
        """Latch a message: later subscribers receive it at once."""
        self._implementation.latch = message

    def flush(self) -> bool:
        """Send what waits, as far as that goes at once; returns whether nothing waits any more."""
        for connection in list(self._backlogs):
            self._push(connection)
        return not self._backlogs

    def close(self) -> None:
        """Unregister."""
        for backlog in self._backlogs.values():
            backlog.newest.pop(self, None)
        self._publisher.unregister()

    def _keep(self, connection: TCPROSTransport, message: bytes, sent: int) -> None:
        """Keep a message, of which the first `sent` bytes are in progress."""
        for known in [each for each in self._backlogs if each.done]:
            del self._backlogs[known]
        self._backlogs[connection] = SendBacklog(newest={self: message})
        self._backlogs[connection].subtract(sent)

    def _push(self, connection: TCPROSTransport) -> None:
        backlog = self._backlogs[connection]
        waiting = backlog.waiting
        sent = _send(connection, waiting)
        backlog.subtract(sent)
        if sent == len(waiting):
            del self._backlogs[connection]


def _send(connection: TCPROSTransport, data: bytes | bytearray) -> int:
    """Send at once what the operating system accepts; returns that count of bytes, all for a broken connection."""
    try:
        sent = connection.socket.send(data, SEND_FLAGS)
    except BlockingIOError:
        return 0
    except (OSError, AttributeError):  # rospy takes the socket away from a connection that it closes
        connection.close()
        return len(data)
    connection.stat_bytes += sent
    connection.stat_num_msg += 1
    return sent
