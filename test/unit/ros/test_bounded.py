"""Connections of rospy that bring no more than they may, over real sockets."""

import socket
import threading
from io import BytesIO

import pytest
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransportProtocol, recv_buff
from std_msgs.msg import String

from solfer.middleware.ros.codecs import bounded
from solfer.middleware.ros.codecs.bounded import Rate, bound_messages, bound_requests
from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH


def packed(text):
    """Pack a std_msgs/String as on the wire."""
    body = MESSAGE_LENGTH.pack(len(text)) + text.encode()
    return MESSAGE_LENGTH.pack(len(body)) + body


class ReceivingThread:
    """Reads a connection as rospy's receiving thread does."""

    def __init__(self, bind):
        self.protocol = TCPROSTransportProtocol("t", String, queue_size=64)
        bind(self.protocol)
        self.sender, self.sock = socket.socketpair()
        self.buffer, self.largest = BytesIO(), 0

    def send(self, data):
        """Send beside the reading, and end."""
        threading.Thread(target=lambda: (self.sender.sendall(data), self.sender.close()), daemon=True).start()

    def all(self):
        """Return what arrives until the sender ends."""
        got = []
        while True:
            queue = []
            if self.buffer.tell() >= 4:
                self.protocol.read_messages(self.buffer, queue, self.sock)
            self.largest = max(self.largest, len(self.buffer.getbuffer()))
            got += [getattr(item, "data", item) for item in queue]
            if not queue:
                try:
                    recv_buff(self.sock, self.buffer, self.protocol.buff_size)
                except TransportTerminated:
                    return got


def test_a_large_message_is_thrown_away_unread():
    sizes = []
    reading = ReceivingThread(lambda protocol: bound_messages(protocol, 100, sizes.append))
    reading.send(packed("first") + packed(5_000_000 * "x") + packed("second") + packed(3000 * "y") + packed("third"))
    got = [text for text in reading.all() if len(text) < 100]
    assert got == ["first", "second", "third"]
    assert sizes[0] == 5_000_004 and reading.largest < 10_000


def test_a_large_request_is_answered_instead():
    answer = "no {}".format
    reading = ReceivingThread(lambda protocol: bound_requests(protocol, 100, Rate(1e6, 10), answer, "busy"))
    reading.send(packed(5_000_000 * "x") + packed("second"))
    assert reading.all() == ["no 5000004", "second"]


def test_a_message_of_no_end_closes_its_connection():
    reading = ReceivingThread(lambda protocol: bound_messages(protocol, 100, lambda size: None))
    reading.send(MESSAGE_LENGTH.pack(2**32 - 1) + 1000 * b"x")
    recv_buff(reading.sock, reading.buffer, 4096)
    with pytest.raises(TransportTerminated, match="4294967295 bytes"):
        reading.protocol.read_messages(reading.buffer, [], reading.sock)


def test_requests_are_decoded_at_a_rate(monkeypatch):
    now, slept = [10.0], []
    monkeypatch.setattr(bounded.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(bounded.time, "sleep", slept.append)
    rate = Rate(10.0, 3)
    assert [rate.wait() for _ in range(20)].count(True) == 4 + 10  # a burst, and as many as wait for a second
    assert slept == pytest.approx([0.1 * number for number in range(1, 11)])
    now[0] = 100.0
    assert all(rate.wait(0.0) for _ in range(3))
