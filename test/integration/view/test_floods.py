"""`solfer view --run` as a process that others flood: it serves the page that commands as before."""

import http.client
import json
import os
import re
import resource
import socket
import threading
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

import msgspec
import numpy as np
import pytest

viser = pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")
pytest.importorskip("foxglove", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page, started_view  # noqa: E402
from support.processes import until  # noqa: E402
from viser import _messages  # noqa: E402
from websockets.exceptions import ConnectionClosed  # noqa: E402
from websockets.frames import Frame, Opcode  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[3]
STUDY = f"""
configuration: {{file: {REPOSITORY}/config/centauro.yaml}}
plugins: ["odometry3::odometry", wheeled_motion]
motion: {{function: "builtins:print"}}
settle: 2.0
duration: 600.0
"""
SPAN = 1.0
"""Of a flood [s]."""

LONGEST_GAP = 0.5
"""Between two messages to the page that commands, after which it would lose control [s]."""

GROWTH = 50.0
"""Most memory that a flood may leave behind, or need meanwhile [MB]."""


class Served:
    """The process, and a page that commands, which a thread receives."""

    def __init__(self, process, address, foxglove, page):
        self.process, self.address, self.foxglove, self.page = process, address, foxglove, page
        self._gap = 0.0
        self._stop = threading.Event()
        self._receiver = threading.Thread(target=self._receive, daemon=True)
        self._receiver.start()

    def _receive(self):
        beat = next(key for key, props in self.page.gui.items() if "solfer-beat" in str(props.get("content")))
        last = time.monotonic()
        waited = self._waited()
        before = dict(self.page.gui[beat])
        while not self._stop.is_set():
            self.page.receive(0.03)
            gap = time.monotonic() - last
            if gap > self._gap:  # for a processor of a busy machine page and test cannot but wait
                now = self._waited()
                for process in now:
                    gap -= max(now[process][task] - waited[process].get(task, 0.0) for task in now[process])
                self._gap = max(self._gap, gap)
            if self.page.gui[beat] != before:
                before = dict(self.page.gui[beat])
                last = time.monotonic()
                waited = self._waited()

    def _waited(self):
        """Return how long threads of the process, and of this one, have been ready without a processor [s]."""
        waited = {}
        for process in (self.process.pid, os.getpid()):
            waited[process] = {}
            for task in Path(f"/proc/{process}/task").iterdir():
                with suppress(OSError):  # it has ended
                    waited[process][task.name] = 1e-9 * int((task / "schedstat").read_text().split()[1])
        return waited

    @property
    def port(self):
        """Port of the page."""
        return int(re.search(r":(\d+)/", self.address)[1])

    def memory(self):
        """Return the memory of the process [MB]."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024.0

    def files(self):
        """Return the number of its open files."""
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    @contextmanager
    def undisturbed(self, rest=0.5):
        """Assert that the page keeps control and pace meanwhile and `rest` [s] longer, and the memory its size."""
        if "you have control" not in self.page.content:  # a flood before has taken control away
            self.page.click("take control")
            time.sleep(rest)
        before = self.memory()
        self._gap = 0.0
        yield
        top = self.memory()
        time.sleep(rest)
        after = self.memory()
        print(f"gap {self._gap:.2f} s, {before:.0f} MB, then {top:.0f} MB, then {after:.0f} MB, {self.files()} files")
        assert self._gap < LONGEST_GAP and max(top, after) - before < GROWTH
        assert self.process.poll() is None and self._receiver.is_alive()
        assert "you have control" in self.page.content

    def close(self):
        self._stop.set()
        self._receiver.join()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """Start it; it ends well by Ctrl-C, and its log has no traceback, and few lines."""
    folder = tmp_path_factory.mktemp("floods")
    (folder / "study.yaml").write_text(STUDY)
    words = ("--run", str(folder / "study.yaml"), "--control", "--foxglove")
    with (folder / "log").open("w") as log:
        with started_view(*words, stderr=log) as (process, address), opened_page(address) as page:
            foxglove = process.stdout.readline().strip()
            page.until(lambda: page.is_known and "wheeled_motion" in page.tabs, "a page with plugins")
            page.click("take control")
            page.until(lambda: "you have control" in page.content, "control")
            page.receive(1.0)
            with closing(Served(process, address, foxglove, page)) as made:
                yield made
        assert process.wait() == 0
    lines = (folder / "log").read_text().splitlines()
    assert len(lines) < 200 and not [each for each in lines if "Traceback" in each]


@contextmanager
def attacker(served):
    """Open a page that ends without a good-bye."""
    with opened_page(served.address) as page:
        page.until(lambda: page.is_known and "take control" in page.labels, "a page")
        yield page
        cut(page._life)
        cut(page._connection)


def cut(connection):
    """End a connection at once, without a good-bye."""
    connection.close_timeout = 0.1
    with suppress(OSError):
        connection.socket.shutdown(socket.SHUT_RDWR)


def encoded(message):
    return msgspec.msgpack.encode(message.as_serializable_dict())


def update(page, label, value):
    return encoded(_messages.GuiUpdateMessage(page.find(label), {"value": value}))


def hold(page):
    return encoded(_messages.GuiButtonHoldMessage(page.find("take control"), 10.0))


def drag(name, x):
    return encoded(_messages.TransformControlsUpdateMessage(name, (1.0, 0.0, 0.0, 0.0), (x, 0.0, 0.0)))


def camera(x):
    numbers = (1.0, 0.1, 100.0, 600, 800)
    return encoded(_messages.ViewerCameraMessage((1.0, 0.0, 0.0, 0.0), (x, 3.0, 3.0), *numbers, (0.0,) * 3, (0.0,) * 3))


NUMBERS = np.linspace(0.02, 0.5, 1000).tolist()

FLOODS = {
    "slider": lambda page: [update(page, "speed [m/s]", each) for each in NUMBERS],
    "take control": lambda page: [update(page, "take control", True)],
    "questions of the stop": lambda page: [update(page, "EMERGENCY STOP", True)],
    "drive": lambda page: [hold(page)],
    "drag": lambda _: [drag(f"/drag/{each}", each) for each in NUMBERS],
    "camera": lambda _: [camera(each) for each in NUMBERS],
    "unknown inputs": lambda _: [encoded(_messages.GuiUpdateMessage(str(each), {"value": each})) for each in NUMBERS],
    "junk": lambda _: [b"\xc1"],
    "nested": lambda _: [b"\x91" * 60000],
    "pings": lambda _: [125 * b"x"],
    "pongs": lambda _: [125 * b"x"],
    "fragments": lambda _: [b""],
    "keys of dialogs": lambda _: [encoded(_messages.GuiUpdateMessage(f"{60_000 * 'x'}", {"value": True}))],
    "give it back": lambda page: [update(page, "give it back", True)],
    "plots": lambda page: [update(page, "column", "centre of mass/z [m]"), update(page, "add", True)],
    "signs of life": lambda _: [b""],
    "Foxglove's junk": lambda _: [b"{", b'{"op": "other"}', 1000 * b"["],
    "Foxglove's parameters": lambda _: [
        json.dumps({"op": op, key: value}).encode()
        for op, key, value in (
            ("setParameters", "parameters", [{"name": "wheeled_motion.base_speed", "value": 1e308}]),
            ("getParameters", "parameterNames", []),
        )
    ],
    "Foxglove's subscriptions": lambda _: [
        json.dumps({"op": op, key: [{"id": 1, "channelId": 1} for _ in range(1000)]}).encode()
        for op, key in (("subscribe", "subscriptions"), ("unsubscribe", "subscriptionIds"))
    ],
    "Foxglove's schemas": lambda _: [
        json.dumps({"op": "advertise", "channels": [{**CHANNEL, "id": each, "schema": 50_000 * "x"}]}).encode()
        for each in range(2)
    ],
}

CHANNEL = {"topic": "/a", "encoding": "json", "schemaName": "a"}
OPCODES = {"pings": Opcode.PING, "pongs": Opcode.PONG}


@pytest.mark.daily(5)
@pytest.mark.parametrize("kind", FLOODS)
def test_a_flood_neither_delays_others_nor_stays(served, kind):
    """As fast as the socket takes them, from a sender that reads nothing."""
    with ExitStack() as stack:
        if kind.startswith("Foxglove"):
            connection = stack.enter_context(connect(served.foxglove, subprotocols=["foxglove.sdk.v1"]))
            messages = FLOODS[kind](None)
            opcode = Opcode.TEXT
        else:
            page = stack.enter_context(attacker(served))
            connection = page._life if kind == "signs of life" else page._connection
            messages = FLOODS[kind](page)
            opcode = OPCODES.get(kind, Opcode.BINARY)
        frames = [Frame(opcode, each).serialize(mask=True) for each in messages]
        if kind == "fragments":
            connection.socket.sendall(Frame(opcode, b"", fin=False).serialize(mask=True))
            frames = [Frame(Opcode.CONT, b"", fin=False).serialize(mask=True)]
        batch = b"".join(frames * max(100_000 // len(b"".join(frames)), 1))
        connection.socket.settimeout(SPAN)
        end = time.monotonic() + SPAN
        with served.undisturbed(), suppress(OSError):  # it is not read any more, or closed
            while time.monotonic() < end:
                connection.socket.sendall(batch)
        with served.undisturbed():
            cut(connection)


@pytest.mark.parametrize("size", [70_000, 1_000_000, 20_000_000])
@pytest.mark.parametrize("address", ["address", "foxglove"])
def test_a_message_that_is_too_large_closes_its_connection(served, address, size):
    message = encoded(_messages.GuiUpdateMessage("a", {"value": size * "x"}))
    with ExitStack() as stack:
        if address == "address":
            connection = stack.enter_context(opened_page(served.address))._connection
        else:
            connection = stack.enter_context(connect(served.foxglove, subprotocols=["foxglove.sdk.v1"]))
        with served.undisturbed(), pytest.raises((ConnectionClosed, OSError)):
            connection.send(message)
            for _ in range(1000):
                connection.recv(timeout=5.0)


def test_a_file_that_a_page_sends_is_not_taken(served):
    """18 MB in parts below the largest message."""
    with attacker(served) as page, served.undisturbed():
        place = page.find("take control")
        page.send(_messages.FileTransferStartUpload(place, "t", "a", "a", part_count=300, size_bytes=18_000_000))
        part = encoded(_messages.FileTransferPart(place, "t", 0, 60_000 * b"x"))
        for _ in range(300):
            page._connection.send(part)


def test_pages_that_read_nothing_or_come_and_go(served):
    """Five that take nothing for some seconds, and sixty one after the other, without a good-bye."""
    files = served.files()
    with ExitStack() as stack, served.undisturbed(2.0):
        for _ in range(5):
            stack.callback(cut, stack.enter_context(opened_page(served.address))._connection)
    with served.undisturbed():
        for _ in range(60):
            with opened_page(served.address) as page:
                cut(page._connection)
    until(lambda: served.files() <= files, "files that are closed")


def one_byte_each(connections):
    """Send a byte of a request by each of them, ten times within a second."""
    for byte in b"GET / HTTP":
        for connection in connections:
            connection.send(bytes([byte]))
        time.sleep(0.1)


SILENT = {
    "nothing": (200, lambda _: None),
    "a part of a request": (200, lambda those: [each.sendall(b"GET / HTTP/1.1\r\nHost:") for each in those]),
    "half-closed": (100, lambda those: [each.shutdown(socket.SHUT_WR) for each in those]),
    "slow": (50, one_byte_each),
}


@pytest.mark.parametrize("kind", SILENT)
def test_silent_connections_keep_no_page_out(served, kind):
    """As many as a web page or a program opens: the page is served beside them, and their files are free later."""
    files = served.files()
    count, work = SILENT[kind]
    with ExitStack() as stack, served.undisturbed():
        address = ("127.0.0.1", served.port)
        connections = [stack.enter_context(socket.create_connection(address, timeout=5.0)) for _ in range(count)]
        work(connections)
        begin = time.monotonic()
        request = http.client.HTTPConnection("localhost", served.port, timeout=5.0)
        stack.callback(request.close)
        request.request("GET", "/" + served.address.split("/", 3)[3])
        assert request.getresponse().status == 200 and time.monotonic() - begin < 1.0
    until(lambda: served.files() <= files, "files that are closed")


@pytest.mark.soak
def test_slow_headers_have_an_end(served):
    """A byte a second for each of 50 connections: they are closed 10 s after they were opened."""
    files = served.files()
    with ExitStack() as stack, served.undisturbed():
        address = ("127.0.0.1", served.port)
        connections = [stack.enter_context(socket.create_connection(address, timeout=5.0)) for _ in range(50)]
        begin = time.monotonic()
        for byte in 20 * b"GET ":
            with suppress(ConnectionError):
                for connection in connections:
                    connection.send(bytes([byte]))
            time.sleep(1.0)
            if served.files() <= files:
                break
        assert 5.0 < time.monotonic() - begin < 15.0


def test_files_that_run_out_keep_new_pages_out(served):
    """The process may have 20 more files: beside 100 connections its page commands on, later a new one is served."""
    files = served.files()
    before = resource.prlimit(served.process.pid, resource.RLIMIT_NOFILE)
    resource.prlimit(served.process.pid, resource.RLIMIT_NOFILE, (files + 20, before[1]))
    try:
        with ExitStack() as stack, served.undisturbed(1.5):
            for _ in range(100):
                stack.enter_context(socket.create_connection(("127.0.0.1", served.port), timeout=5.0))
            time.sleep(0.5)
        until(lambda: served.files() <= files, "files that are closed")
    finally:
        resource.prlimit(served.process.pid, resource.RLIMIT_NOFILE, before)
    with attacker(served), served.undisturbed():
        pass


def test_only_addresses_of_this_machine_listen(served):
    """All sockets of the process that take connections or datagrams are in 127.0.0.0/8, Foxglove's included."""
    folder = Path(f"/proc/{served.process.pid}")
    links = [os.readlink(each) for each in (folder / "fd").iterdir()]
    own = {each.removeprefix("socket:[").rstrip("]") for each in links}
    found = []
    for kind, states in (("tcp", {"0A"}), ("tcp6", {"0A"}), ("udp", {"07"}), ("udp6", {"07"})):
        for line in (folder / "net" / kind).read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in own and fields[3] in states:
                found.append((kind, fields[1][6:8]))
    assert found == 2 * [("tcp", "7F")]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.connect(("192.0.2.1", 9))  # nothing is sent; it shows the address towards others
        address = other.getsockname()[0]
    with pytest.raises(OSError):
        socket.create_connection((address, served.port), timeout=1.0).close()


def test_the_stop_asks_at_once_beside_a_flood(served):
    with attacker(served) as flooding, attacker(served) as other, served.undisturbed():
        frame = Frame(Opcode.BINARY, update(flooding, "EMERGENCY STOP", True)).serialize(mask=True)
        flooding._connection.socket.settimeout(0.05)
        begin = time.monotonic()
        other.click("EMERGENCY STOP")
        while "stop the robot now" not in other.labels:
            with suppress(OSError):
                flooding._connection.socket.send(1000 * frame)
            other.receive(0.02)
            assert time.monotonic() - begin < 1.0
