"""A page of viser without a browser: its websocket, in the messages of viser itself."""

import re
import shutil
import signal
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import msgspec
import viser
import zstandard
from viser import _messages
from websockets.sync.client import connect

ADDRESS = re.compile(r"http://localhost:\d+/[\w-]{20,}/\n")
REPOSITORY = Path(__file__).parents[2]

PATIENCE = 20.0
"""Longest time in which the command ends by Ctrl-C [s]."""


class FakePage:
    """One page; it sends signs of life as long as `is_alive`, and something is received."""

    def __init__(self, connection, connect):
        self._connection, self._connect, self.is_alive = connection, connect, True
        self._life = None
        self.nodes, self.gui, self.scripts, self.modals = {}, {}, [], []
        self.positions, self.turns, self.visible, self.cameras = {}, {}, {}, []
        self.notes, self.files = [], []
        self.send(
            _messages.ViewerCameraMessage(
                (1.0, 0.0, 0.0, 0.0), (3.0, 3.0, 3.0), 1.0, 0.1, 100.0, 600, 800, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
            )
        )

    def send(self, message):
        """Send a message of a page."""
        self._connection.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def receive(self, duration=0.15):
        """Take what arrives within a time [s]."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            try:
                data = self._connection.recv(timeout=min(left, 0.05))
            except TimeoutError:
                continue
            finally:
                self._live()
            size = int.from_bytes(data[8:16], "little")
            for message in msgspec.msgpack.decode(zstandard.decompress(data[16 : 16 + size]))["messages"]:
                self._take(message)

    def take_raw(self, duration):
        """Take what arrives within a time [s] without a look at it; return the number of messages."""
        end, count = time.monotonic() + duration, 0
        while (left := end - time.monotonic()) > 0.0:
            try:
                self._connection.recv(timeout=left)
                count += 1
            except TimeoutError:
                break
        self._live()
        return count

    def find(self, label):
        """Return the identity of what has a label or a text."""
        return next(key for key, props in self.gui.items() if label in (props.get("label"), props.get("content")))

    @property
    def content(self):
        """All texts of the page."""
        texts = (props.get(key, "") for props in self.gui.values() for key in ("content", "_markdown"))
        return " ".join(map(str, texts))

    @property
    def labels(self):
        """Labels of all buttons and inputs."""
        return {props.get("label") for props in self.gui.values()}

    @property
    def is_known(self):
        """Whether it shows life."""
        return self._life is not None

    @property
    def tabs(self):
        """Names of all tabs."""
        return [name for props in self.gui.values() for name in props.get("_tab_labels") or ()]

    def until(self, condition, what, patience=40.0):
        """Receive until a condition holds."""
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end, f"not within {patience:g} s: {what}\n{self.content}"
            self.receive(0.1)

    def click(self, label):
        """Click on a button."""
        self.send(_messages.GuiUpdateMessage(self.find(label), {"value": True}))

    def hold(self, label):
        """Press a button of the pad for a tenth of a second."""
        self._life.send(label)

    def change(self, label, value):
        """Give an input a value."""
        self.send(_messages.GuiUpdateMessage(self.find(label), {"value": value}))

    def close(self):
        """Close the page."""
        self._connection.close()
        if self._life is not None:
            self._life.close()

    def _live(self):
        keys = re.findall(r"}(life/[\w-]+)`", " ".join(self.scripts))
        if self._life is None and keys:
            self._life = self._connect(keys[0])
        if self._life is not None and self.is_alive:
            self._life.send("")

    def _take(self, message):
        kind = message["type"]
        if kind == "RunJavascriptMessage":
            self.scripts.append(message["source"])
        elif kind == "SetPositionMessage":
            self.positions[message["name"]] = message["position"]
        elif kind == "SetOrientationMessage":
            self.turns[message["name"]] = message["wxyz"]
        elif kind == "SetSceneNodeVisibilityMessage":
            self.visible[message["name"]] = message["visible"]
        elif kind == "SetCameraPositionMessage" and not message["initial"]:
            self.cameras.append(message["position"])
        elif kind == "GuiUpdateMessage":
            self.gui.setdefault(message["uuid"], {}).update(message["updates"])
        elif kind == "GuiModalMessage":
            self.modals.append(message["title"])
        elif kind == "FileTransferPart":
            self.files.append(message["content"].decode())
        elif kind == "NotificationShowMessage":
            self.notes.append(message["props"]["body"])
        elif "props" in message and "uuid" in message:
            self.gui[message["uuid"]] = dict(message["props"], value=message.get("value"))
        elif "props" in message:
            self.nodes[message["name"]] = message["props"]


@contextmanager
def opened_page(address, origin=None):
    """Open a page of a server."""
    place = address.removeprefix("http").rstrip("/")
    own = "http" + place.rpartition("/")[0]

    def connection(path="", *protocols):
        return connect(
            f"ws{place}/{path}", origin=origin or own, subprotocols=protocols or None, max_size=None, compression=None
        )

    with connection("", f"viser-v{viser.__version__}") as first:
        page = FakePage(first, connection)
        try:
            yield page
        finally:
            page.close()


@contextmanager
def started_view(*words, stderr=None):
    """Start `solfer view` on any port; yields its process and its address, and ends it. `stderr` is a file for that."""
    program = [shutil.which("solfer"), "view", "--port", "0", *words]
    with subprocess.Popen(program, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=stderr, text=True) as process:
        try:
            first = process.stdout.readline()
            assert ADDRESS.fullmatch(first), first
            yield process, first.strip()
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()


@contextmanager
def view(*words):
    """Start `solfer view` on any port; yields its address. It has to end well by Ctrl-C."""
    with started_view(*words) as (process, address):
        yield address
    assert process.wait() == 0


def drive(address):
    """Take control and drive ahead, without an end; for a process of its own."""
    with opened_page(address) as page:
        page.until(lambda: "take control" in page.labels and page.is_known, "a page that may command")
        page.click("take control")
        while True:
            page.hold("ahead")
            page.receive(0.1)
