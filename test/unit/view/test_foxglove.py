"""The server for Foxglove, by a client of its websocket protocol."""

import json
import struct
from contextlib import closing, contextmanager, suppress

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")
pytest.importorskip("foxglove", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page  # noqa: E402
from support.page_bench import PageBench  # noqa: E402
from support.robots import upper_body  # noqa: E402
from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

from solfer.transport.parameters import SetParameters  # noqa: E402

pytestmark = pytest.mark.slow

PROTOCOL = "foxglove.sdk.v1"


class Client:
    """A client, which subscribes to all channels."""

    def __init__(self, connection):
        self._connection = connection
        self.topics, self.data, self.answers = {}, {}, {}
        self.server = None

    def send(self, **message):
        self._connection.send(json.dumps(message))

    def receive(self):
        """Take what is there."""
        while True:
            try:
                message = self._connection.recv(timeout=0.02)
            except TimeoutError:
                return
            if isinstance(message, bytes):
                kind, subscription = struct.unpack_from("<BI", message)
                assert kind == 1
                self.data[self.topics[subscription]] = message[13:]
                continue
            message = json.loads(message)
            if message["op"] == "serverInfo":
                self.server = message
            elif message["op"] == "advertise":
                for channel in message["channels"]:
                    self.topics[channel["id"]] = channel["topic"]
                    subscription = {"id": channel["id"], "channelId": channel["id"]}
                    self.send(op="subscribe", subscriptions=[subscription])
            elif message["op"] == "parameterValues":
                values = {each["name"]: each["value"] for each in message["parameters"]}
                self.answers[message.get("id")] = values


@contextmanager
def served(repository, control):
    bench = PageBench(upper_body(), control, foxglove=True)
    server = bench.page.foxglove
    with closing(bench.server), closing(server), connect(server.address, subprotocols=[PROTOCOL]) as connection:
        client = Client(connection)
        bench.clients = [client_of(client)]
        bench.run(20)
        yield bench, client


@pytest.fixture(scope="module")
def commanded(repository):
    """Serve once for all that a client sends in vain."""
    with served(repository, True) as made:
        yield made


def client_of(client):
    """Let the bench receive what is for the client."""

    class _Receiver:
        def receive(self, _):
            client.receive()

    return _Receiver()


def test_channels_have_what_the_robot_publishes(repository):
    with served(repository, False) as (bench, client):
        bench.robot.command.position[:] = np.linspace(-0.3, 0.3, bench.robot.size)
        bench.run(10)
        assert client.server["name"] == "solfer" and "parameters" in client.server["capabilities"]
        joints, frames = client.data["/joint_states"], client.data["/tf"]
        for name, value in zip(bench.robot.dofs, bench.robot.command.position.tolist(), strict=True):
            assert name.encode() in joints and struct.pack("<d", value) in joints
        place = bench.state.measured["arm1_7"].position
        assert b"arm1_7" in frames and all(struct.pack("<d", each) in frames for each in place.tolist())
        columns = json.loads(client.data["/columns"])
        assert columns["centre of mass/z [m]"] == pytest.approx(bench.state.center[2])
        assert columns["hands/cycle p99 [ms]"] == 1.25


def test_parameters_are_read_and_not_changed_without_control(repository):
    with served(repository, False) as (bench, client):
        client.send(op="getParameters", parameterNames=[], id="all")
        bench.until(lambda: "all" in client.answers)
        assert client.answers["all"] == {"hands.gain": 2.0}
        changes = [{"name": "hands.gain", "value": each} for each in (3.0, "3.0", True, [3.0], {"a": 3.0})]
        client.send(op="setParameters", parameters=changes, id="set")
        bench.until(lambda: "set" in client.answers)
        bench.run(10)
        assert client.answers["set"] == {"hands.gain": 2.0} and not bench.asked


def test_parameters_change_with_control_while_no_page_commands(repository):
    """Foxglove may set parameters until a page takes control, and not against it."""
    with served(repository, True) as (bench, client):
        client.send(op="subscribeParameterUpdates", parameterNames=["hands.gain"])
        client.send(op="setParameters", parameters=[{"name": "hands.gain", "value": 3.5}], id="set")
        bench.until(lambda: bench.asked)
        assert bench.asked == [SetParameters(("gain",), ("3.5",))]
        bench.until(lambda: client.answers.get(None) == {"hands.gain": 3.5})
        with opened_page(bench.server.address) as page:
            bench.clients.append(page)
            bench.until(lambda: page.is_known and "take control" in page.labels)
            bench.run(4)
            page.click("take control")
            bench.until(lambda: "you have control" in page.content)
            client.send(op="setParameters", parameters=[{"name": "hands.gain", "value": 9.0}], id="late")
            bench.until(lambda: "late" in client.answers)
            bench.run(10)
        assert len(bench.asked) == 1


OTHER_REQUESTS = {
    "channel with a huge schema": [
        {
            "op": "advertise",
            "channels": [
                {"id": 1, "topic": "/hands/cmd_vel", "encoding": "json", "schemaName": "a", "schema": 50_000 * "x"}
            ],
        },
        b"\x01" + struct.pack("<I", 1) + b"{}",
    ],
    "channel that is not there": [b"\x01" + struct.pack("<I", 99) + b"{}", {"op": "unadvertise", "channelIds": [99]}],
    "service": [
        {"op": "advertiseServices", "services": [{"id": 1, "name": "lower_level/emergency_stop", "type": "a"}]},
        b"\x02" + struct.pack("<III", 1, 1, 4) + b"json{}",
        b"\x02" + struct.pack("<III", 1, 1, 2**32 - 1),
    ],
    "subscriptions to one": [
        {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": each} for each in (1, 1, 2, 2**64 - 1)]},
        {"op": "unsubscribe", "subscriptionIds": [1, 1, 99]},
        {"op": "subscribe", "subscriptions": [{"id": -1, "channelId": "1"}]},
    ],
    "files": [
        {"op": "fetchAsset", "uri": uri, "requestId": number}
        for number, uri in enumerate(("file:///etc/passwd", "package://../../etc/passwd", "", 1000 * "../"))
    ],
    "graph": [{"op": "subscribeConnectionGraph"}, {"op": "subscribeConnectionGraph"}],
    "parameters to watch": [
        {"op": op, "parameterNames": names}
        for names in (
            [],
            ["hands.gain", "hands.gain"],
            [50_000 * "x"],
            [f"{each}" for each in range(5000)],
            "hands.gain",
        )
        for op in ("subscribeParameterUpdates", "unsubscribeParameterUpdates")
    ],
    "time": [b"\x03" + bytes(20), {"op": "playbackControl", "playbackState": 1}],
    "bytes": [b"", b"\x00", b"\xff" * 1000, b"\x01", b"\x02\x00"],
    "text": ["", "{", "[]", "null", '{"op": 1}', '{"op": {}}', 30_000 * "[", '{"op": "setParameters"}'],
}


@pytest.mark.parametrize("kind", OTHER_REQUESTS)
def test_other_requests_change_nothing(commanded, caplog, capfd, kind):
    """They may end their connection; another client has its parameters, and nobody commands."""
    bench, client = commanded
    with (
        connect(bench.page.foxglove.address, subprotocols=[PROTOCOL]) as other,
        suppress(ConnectionClosed, TimeoutError),
    ):
        for each in OTHER_REQUESTS[kind]:
            other.send(json.dumps(each) if isinstance(each, dict) else each)
            bench.run(1)
        while True:
            assert "root:" not in str(other.recv(timeout=0.1))
    client.answers.clear()
    bench.asked.clear()
    client.send(op="getParameters", parameterNames=[], id="all")
    bench.until(lambda: "all" in client.answers)
    assert client.answers["all"] == {"hands.gain": float(bench.gain)} and not bench.asked and not bench.driven.drain()
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr()) and len(caplog.records) < 10


def test_only_programs_with_the_token_are_served(repository):
    """Without it, or from the page of another origin, there is nothing; the server behind has no parameters."""
    with served(repository, True) as (bench, _):
        address = bench.page.foxglove.address
        token = address.split("/")[-2]
        own = bench.server.address.split("/")[2]
        wrong = (token[:-1], token.swapcase(), f"{token}x", "", f"?{token}", f"%{ord(token[0]):02x}{token[1:]}")
        tried = [(address.replace(token, each), None) for each in wrong]
        origins = ("https://evil.example", "null", "", f"https://{own}", "http://app.foxglove.dev", "file://x")
        tried += [(address, each) for each in origins]
        tried += [(address.replace("localhost", "127.0.0.1").replace("127", "0x7f", 1), None)]
        for place, origin in tried:
            with pytest.raises(InvalidStatus):
                headers = {} if origin is None else {"Origin": origin}
                connect(place, subprotocols=[PROTOCOL], additional_headers=headers)
        connect(address, subprotocols=[PROTOCOL], origin="https://app.foxglove.dev").close()
        with connect(bench.page.foxglove._relay.behind, subprotocols=[PROTOCOL]) as connection:
            client = Client(connection)
            bench.clients.append(client_of(client))
            client.send(op="setParameters", parameters=[{"name": "hands.gain", "value": 9.0}], id="set")
            client.send(op="getParameters", parameterNames=[], id="all")
            bench.until(lambda: "all" in client.answers)
            bench.run(4)
            assert not client.answers["all"] and not bench.asked


VALUES = (
    ("AAAA", "byte_array"),
    ("A", "byte_array"),
    (3.0, "byte_array"),
    ("a", "float64"),
    ("a", "float64_array"),
    ([1.0, "a", None, [], {}], "float64_array"),
    ([], "float64"),
    (True, "float64"),
    ({"a": {"b": [1e308]}}, None),
    (10**400, None),
    ("\0", None),
    (10_000 * "x", None),
    (3.0, "unknown"),
    (3.0, 1),
    ("nested", None),
    (None, None),
)


@pytest.mark.parametrize("name", ["hands.gain", "other.gain", "..", "", "hands.gain\\u0000", 1000 * "hands."])
def test_values_that_are_none_end_nothing(commanded, caplog, name):
    """Bytes, bytes that cannot be decoded, nested values, unknown names; then a number counts."""
    nested = 1
    for _ in range(100):
        nested = [nested]
    bench, client = commanded
    for value, kind in VALUES:
        value = nested if value == "nested" else value
        client.send(op="setParameters", parameters=3 * [{"name": name, "value": value, "type": kind}])
        client._connection.send(f'{{"op":"setParameters","parameters":[{{"name":"{name}","value":1e400}}]}}')
        bench.run(2)
    assert all("\n" not in line for line in caplog.messages)
    bench.asked.clear()
    client.send(op="setParameters", parameters=[{"name": "hands.gain", "value": 3.5}])
    bench.until(lambda: bench.asked)
    assert bench.asked == [SetParameters(("gain",), ("3.5",))]
