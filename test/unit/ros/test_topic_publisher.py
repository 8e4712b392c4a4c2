"""Sending to subscribers that read, that read slowly, that hang and that are gone; connections are rospy's own."""

import random
import socket
import struct

import pytest
import std_msgs.msg as std_messages
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import TCPROSPub

from solfer.errors import MiddlewareError
from solfer.middleware.ros.codecs.packed_message import PackedMessage
from solfer.middleware.ros.topic_publisher import TopicPublisher

BODY = bytes(range(256)) * 40
BUFFER = 20_000
"""About two messages."""

PARTS = 8000
"""So small that a message is sent in parts."""


class Subscriber:
    """The far end of a connection: reads only when it is asked to."""

    def __init__(self, topic_publisher: TopicPublisher, name: str):
        self._socket, near = socket.socketpair()
        for end in (self._socket, near):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)
        self._socket.setblocking(False)
        self.connection = TCPROSTransport(TCPROSPub(topic_publisher.topic, std_messages.Header), topic_publisher.topic)
        self.connection.set_socket(near, name)
        topic_publisher._implementation.add_connection(self.connection)
        self._bytes = b""

    def read(self, size: int = 1 << 20) -> list[int]:
        """Read up to `size` bytes, check their content, and return the numbers of the messages that are whole now."""
        try:
            self._bytes += self._socket.recv(size)
        except BlockingIOError:
            return []
        numbers = []
        while len(self._bytes) >= 4:
            (length,) = struct.unpack_from("<I", self._bytes)
            if len(self._bytes) < 4 + length:
                break
            message, self._bytes = self._bytes[4 : 4 + length], self._bytes[4 + length :]
            header = std_messages.Header().deserialize(message)
            assert (header.frame_id, message[-len(BODY) :]) == ("map", BODY)
            numbers.append(header.seq)
        return numbers

    def read_all(self) -> list[int]:
        """Read everything that is there."""
        numbers = []
        while news := self.read():
            numbers += news
        return numbers

    def close(self) -> None:
        """Go."""
        self._socket.close()


@pytest.fixture
def topic_publisher():
    topic_publisher = TopicPublisher("/topic", std_messages.Header)
    yield topic_publisher
    topic_publisher.close()


@pytest.fixture
def subscribe(topic_publisher):
    """Return a function that makes a subscriber by its name."""
    made = []
    yield lambda name: made.append(Subscriber(topic_publisher, name)) or made[-1]
    for subscriber in made:
        subscriber.close()


@pytest.fixture
def frame():
    return PackedMessage(BODY, "map")


def test_every_subscriber_receives_every_numbered_message(topic_publisher, subscribe, frame):
    subscribers = [subscribe(f"/{name}") for name in "abc"]
    for number in range(1, 50):
        topic_publisher.send(frame)
        assert [subscriber.read_all() for subscriber in subscribers] == [[number]] * 3
    assert [subscriber.connection.stat_bytes for subscriber in subscribers] == [49 * len(frame.bytes)] * 3


def test_numbers_begin_with_the_first_subscriber(topic_publisher, subscribe, frame):
    topic_publisher.send(frame)
    assert not topic_publisher.has_subscribers()
    subscriber = subscribe("/a")
    assert topic_publisher.has_subscribers()
    topic_publisher.send(frame)
    assert subscriber.read_all() == [1]


def test_a_hanging_subscriber_later_receives_the_newest_message(topic_publisher, subscribe, frame):
    hangs, reads = subscribe("/hangs"), subscribe("/reads")
    has_subscribers = []
    for _ in range(1000):
        topic_publisher.send(frame)
        has_subscribers += reads.read_all()
    assert has_subscribers == list(range(1, 1001))
    old = hangs.read_all()
    assert old == list(range(1, len(old) + 1)) and len(old) < 10
    late = []
    while not topic_publisher.flush():
        late += hangs.read_all()
    late += hangs.read_all()
    assert late in ([1000], [old[-1] + 1, 1000])  # one may have been under way by half


@pytest.mark.parametrize("seed", range(5))
def test_a_slow_subscriber_receives_whole_messages_in_order(topic_publisher, subscribe, frame, seed):
    rng, subscriber = random.Random(seed), subscribe("/slow")
    has_subscribers = []
    for _ in range(500):
        topic_publisher.send(frame)
        has_subscribers += subscriber.read(rng.randrange(1, 2 * len(frame.bytes)))
    while not topic_publisher.flush():
        has_subscribers += subscriber.read(rng.randrange(1, 2 * len(frame.bytes)))
    has_subscribers += subscriber.read_all()
    assert 100 < len(has_subscribers) < 500
    assert has_subscribers == sorted(set(has_subscribers))
    assert has_subscribers[-1] == 500


@pytest.mark.parametrize("seed", range(3))
def test_two_publishers_of_a_topic_share_connections(topic_publisher, subscribe, frame, seed):
    """As two components of a node do that command one controller."""
    rng, subscriber = random.Random(seed), subscribe("/slow")
    subscriber.connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, PARTS)
    other, received = TopicPublisher("/topic", std_messages.Header), []
    for _ in range(300):
        rng.choice((topic_publisher, other)).send(frame)
        received += subscriber.read(rng.randrange(1, len(frame.bytes)))
    other.send(frame)
    topic_publisher.send(frame)
    other.close()  # half of its message may be under way
    while not topic_publisher.flush():
        received += subscriber.read()
    received += subscriber.read_all()
    assert 50 < len(received) < 300 and len(set(received)) == len(received)
    assert max(received) == 302


def test_a_slow_subscriber_receives_the_newest_of_each(topic_publisher, subscribe, frame):
    subscriber, other = subscribe("/hangs"), TopicPublisher("/topic", std_messages.Header)
    for _ in range(20):
        topic_publisher.send(frame)
        other.send(frame)
    received = []
    while not topic_publisher.flush():
        received += subscriber.read()
    received += subscriber.read_all()
    assert sorted(received[-2:]) == [39, 40]
    other.close()


def test_a_gone_subscriber_is_forgotten(topic_publisher, subscribe, frame):
    gone, hung, stays = (subscribe(f"/{name}") for name in ("gone", "hung", "stays"))
    for number in range(1, 20):
        topic_publisher.send(frame)
        assert stays.read_all() == [number]
    gone.close()
    hung.connection.close()
    topic_publisher.send(frame)
    topic_publisher.send(frame)
    assert topic_publisher._implementation.connections == [stays.connection]
    assert topic_publisher.flush()
    assert stays.read_all() == [20, 21]


def test_a_closed_topic_is_an_error(topic_publisher, subscribe, frame):
    subscribe("/a")
    topic_publisher.close()
    with pytest.raises(MiddlewareError, match="is closed"):
        topic_publisher.send(frame)


def test_a_message_without_a_header_is_not_numbered():
    frame = PackedMessage(b"12345678", name=None)
    frame.number(7)
    assert frame.bytes == b"\x08\0\0\0" + b"12345678"
