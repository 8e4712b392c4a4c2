"""Sending to subscribers that read, that read slowly, that hang and that are gone; connections are rospy's own."""

import random
import socket
import struct

import pytest

from solfer.errors import MiddlewareError

rospy = pytest.importorskip("rospy")
std_messages = pytest.importorskip("std_msgs.msg")

from rospy.impl.tcpros_base import TCPROSTransport  # noqa: E402
from rospy.impl.tcpros_pubsub import TCPROSPub  # noqa: E402

from solfer.middleware.ros.frame import Frame  # noqa: E402
from solfer.middleware.ros.outlet import Outlet  # noqa: E402

BODY = bytes(range(256)) * 40
BUFFER = 20_000
"""About two messages."""


class Subscriber:
    """The far end of a connection: reads only when it is asked to."""

    def __init__(self, outlet: Outlet, name: str):
        self._socket, near = socket.socketpair()
        for end in (self._socket, near):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)
        self._socket.setblocking(False)
        self.connection = TCPROSTransport(TCPROSPub(outlet.topic, std_messages.Header), outlet.topic)
        self.connection.set_socket(near, name)
        outlet._implementation.add_connection(self.connection)
        self._bytes = b""

    def read(self, size: int = 1 << 20) -> list[int]:
        """Take up to `size` bytes; numbers of the messages that are whole now. What they hold is checked."""
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
        """Everything that is there."""
        numbers = []
        while news := self.read():
            numbers += news
        return numbers

    def close(self) -> None:
        """Go."""
        self._socket.close()


@pytest.fixture
def outlet():
    outlet = Outlet("/topic", std_messages.Header)
    yield outlet
    outlet.close()


@pytest.fixture
def subscribe(outlet):
    """Makes a subscriber of the outlet by its name."""
    made = []
    yield lambda name: made.append(Subscriber(outlet, name)) or made[-1]
    for subscriber in made:
        subscriber.close()


@pytest.fixture
def frame():
    return Frame(BODY, "map")


def test_every_subscriber_hears_every_message_with_its_number(outlet, subscribe, frame):
    subscribers = [subscribe(f"/{name}") for name in "abc"]
    for number in range(1, 50):
        outlet.send(frame)
        assert [subscriber.read_all() for subscriber in subscribers] == [[number]] * 3
    assert [subscriber.connection.stat_bytes for subscriber in subscribers] == [49 * len(frame.bytes)] * 3


def test_numbers_begin_with_the_first_subscriber(outlet, subscribe, frame):
    outlet.send(frame)
    assert not outlet.heard()
    subscriber = subscribe("/a")
    assert outlet.heard()
    outlet.send(frame)
    assert subscriber.read_all() == [1]


def test_one_who_hangs_holds_up_nobody_and_hears_the_newest_when_he_is_back(outlet, subscribe, frame):
    hangs, reads = subscribe("/hangs"), subscribe("/reads")
    heard = []
    for _ in range(1000):
        outlet.send(frame)
        heard += reads.read_all()
    assert heard == list(range(1, 1001))
    old = hangs.read_all()
    assert old == list(range(1, len(old) + 1)) and len(old) < 10
    late = []
    while not outlet.flush():
        late += hangs.read_all()
    late += hangs.read_all()
    assert late in ([1000], [old[-1] + 1, 1000])  # one may have been under way by half


@pytest.mark.parametrize("seed", range(5))
def test_one_who_reads_slowly_gets_whole_messages_in_order(outlet, subscribe, frame, seed):
    rng, subscriber = random.Random(seed), subscribe("/slow")
    heard = []
    for _ in range(500):
        outlet.send(frame)
        heard += subscriber.read(rng.randrange(1, 2 * len(frame.bytes)))
    while not outlet.flush():
        heard += subscriber.read(rng.randrange(1, 2 * len(frame.bytes)))
    heard += subscriber.read_all()
    assert 100 < len(heard) < 500
    assert heard == sorted(set(heard))
    assert heard[-1] == 500


def test_who_has_gone_is_forgotten(outlet, subscribe, frame):
    gone, hung, stays = (subscribe(f"/{name}") for name in ("gone", "hung", "stays"))
    for number in range(1, 20):
        outlet.send(frame)
        assert stays.read_all() == [number]
    gone.close()
    hung.connection.close()
    outlet.send(frame)
    outlet.send(frame)
    assert outlet._implementation.connections == [stays.connection]
    assert outlet.flush()
    assert stays.read_all() == [20, 21]


def test_a_closed_topic_is_an_error(outlet, subscribe, frame):
    subscribe("/a")
    outlet.close()
    with pytest.raises(MiddlewareError, match="is closed"):
        outlet.send(frame)


def test_a_message_without_a_header_is_not_numbered():
    frame = Frame(b"12345678", name=None)
    frame.number(7)
    assert frame.bytes == b"\x08\0\0\0" + b"12345678"
