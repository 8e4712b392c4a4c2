"""Ports of a node: what strangers send is bounded before rospy waits for it or keeps it."""

import socket
import threading
import time
from io import BytesIO
from types import SimpleNamespace

import pytest
from rosgraph.network import ROSHandshakeException, encode_ros_handshake_header

from solfer.middleware.ros.node import ports
from solfer.middleware.ros.node.ports import LARGEST_CALL, LARGEST_HEADER, BoundedCallServer, read_header

CALL = b"<methodCall><methodName>pid</methodName></methodCall>"


@pytest.fixture
def server():
    made = BoundedCallServer(("127.0.0.1", 0), 0)
    made.register_function(lambda: 7, "pid")
    threading.Thread(target=made.serve_forever, args=(0.01,), daemon=True).start()
    yield made
    made.shutdown()
    made.server_close()


def asked(server, length: bytes, body: bytes = CALL) -> bytes:
    """Return how an answer to a call begins."""
    with socket.create_connection(server.server_address, 5.0) as connection:
        connection.sendall(
            b"POST /RPC2 HTTP/1.1\r\nContent-Type: text/xml\r\nContent-Length: %b\r\n\r\n" % length + body
        )
        return connection.recv(12)


def test_calls_are_bounded(server, caplog):
    assert asked(server, b"%d" % len(CALL)) == b"HTTP/1.1 200"
    for length in (b"-1", b"", b"many", b"%d" % (LARGEST_CALL + 1), 5000 * b"9"):
        assert asked(server, length) == b"HTTP/1.1 413"
    assert caplog.text.count("is refused") == 1


def test_callers_are_bounded_and_leave_their_places(server, monkeypatch):
    monkeypatch.setattr(ports.BoundedCalls, "timeout", 0.1)
    silent = [socket.create_connection(server.server_address, 5.0) for _ in range(ports.CALLERS + 1)]
    assert silent[-1].recv(1) == b""
    end = time.monotonic() + 5.0
    # on a busy machine a call may take longer than the timeout
    while (reply := asked(server, b"%d" % len(CALL))) != b"HTTP/1.1 200" and time.monotonic() < end:
        time.sleep(0.01)
    assert reply == b"HTTP/1.1 200"
    for each in silent:
        each.close()


@pytest.mark.parametrize(
    "sent", [b"", b"\x04\0\0", b"\xff\xff\xff\xff", b"\x04\0\0\0" + b"aaaa", b"\x08\0\0\0" + b"\x04\0\0\0=\xff\xff\xff"]
)
def test_a_header_is_bounded_in_size_and_time(monkeypatch, sent):
    monkeypatch.setattr(ports, "TIMEOUT", 0.05)
    near, far = socket.socketpair()
    with near, far:
        far.sendall(sent)
        with pytest.raises(ROSHandshakeException):
            read_header(near, BytesIO(), LARGEST_HEADER)
        assert near.gettimeout() is None


def test_a_header_is_read_and_nothing_behind_it():
    near, far = socket.socketpair()
    with near, far:
        far.sendall(encode_ros_handshake_header({"topic": "/out", "callerid": "/one"}) + b"message")
        assert read_header(near, BytesIO(), LARGEST_HEADER)["callerid"] == "/one"
        assert near.recv(7) == b"message"


def test_a_list_of_publishers_is_taken_over_once():
    registrations = SimpleNamespace(updates=[])
    update = ports._once(lambda self, name, uris: self.updates.append((name, uris)))
    for uris in (["a", "b"], ["a", "b"], 5000 * ["a"], ["a"]):
        update(registrations, "/joint_states", uris)
    assert registrations.updates == [("/joint_states", ["a", "b"]), ("/joint_states", ["a"])]
