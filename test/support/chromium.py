"""A person's browser: Debian's Chromium without a window, by its mouse and its keys."""

import base64
import itertools
import json
import shutil
import subprocess
import time
import urllib.request
from contextlib import contextmanager

from websockets.sync.client import connect

CHROMIUM = shutil.which("chromium")
FLAGS = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")

SEEN = """
(() => {
  const find = fiber => {
    for (; fiber; fiber = fiber.sibling) {
      const viewer = fiber.memoizedProps?.value?.mutable?.current;
      if (viewer?.nodeRefFromName) return viewer;
      const below = find(fiber.child);
      if (below) return below;
    }
    return null;
  };
  const root = document.getElementById("root");
  const {camera, nodeRefFromName} = window.solferViewer ??=
    find(root[Object.keys(root).find(each => each.startsWith("__reactContainer"))]);
  const places = [];
  for (const [name, node] of Object.entries(nodeRefFromName)) {
    if (name.startsWith("/measured/")) node?.traverse(each => {
      if (!each.geometry) return;
      if (!each.geometry.boundingBox) each.geometry.computeBoundingBox();
      const ends = [each.geometry.boundingBox.min, each.geometry.boundingBox.max];
      for (let corner = 0; corner < 8; corner++) {
        const [x, y, z] = [0, 1, 2].map(axis => ends[corner >> axis & 1].getComponent(axis));
        const point = ends[0].clone().set(x, y, z).applyMatrix4(each.matrixWorld);
        point.applyMatrix4(camera.matrixWorldInverse).applyMatrix4(camera.projectionMatrix);
        places.push([0.5 + 0.5 * point.x, 0.5 - 0.5 * point.y]);
      }
    });
  }
  const ends = end => [0, 1].map(axis => end(...places.map(each => each[axis])));
  const picture = document.querySelector("canvas").getBoundingClientRect();
  const bar = document.getElementById("solfer-banner").getBoundingClientRect();
  return [...ends(Math.min), ...ends(Math.max), bar.bottom / picture.height];
})()
"""
"""Script: box around the boxes of the robot's surfaces as drawn last: left, top, right, bottom; end of the status bar.

All in shares of the picture that the panel leaves free; of three.js, whose objects are found by React's.
"""


def element(text):
    """Return the script of the innermost element with a text."""
    return f"[...document.querySelectorAll('*')].filter(e => e.textContent.trim() === {json.dumps(text)}).at(-1)"


class Browser:
    """One page."""

    def __init__(self, address):
        self._connection = connect(address, max_size=None, origin=None)
        self._numbers = itertools.count(1)
        self._place = (0.0, 0.0)

    def ask(self, method, **parameters):
        """Send a command, and return its result."""
        number = next(self._numbers)
        self._connection.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._connection.recv(timeout=60.0))
            if answer.get("id") == number:
                return answer["result"]

    def evaluate(self, script):
        """Return the value of an expression on the page."""
        return self.ask("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def wait(self, script, patience=40.0):
        """Wait until an expression is true."""
        end = time.monotonic() + patience
        while not self.evaluate(script):
            assert time.monotonic() < end, f"{script}\n{self.evaluate('document.body.innerText')}"
            time.sleep(0.2)

    def click(self, text):
        """Click on what has a text."""
        self.wait(f"!!{element(text)}")
        with self.pressed(self.place(element(text))):
            pass

    def mouse(self, kind, place, pressed=True):
        """Let the mouse do something at a pixel: `mouseMoved`, `mousePressed` or `mouseReleased`."""
        self._place = x, y = place
        button = "left" if pressed else "none"
        clicks = int(pressed)
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=clicks, clickCount=clicks)

    @contextmanager
    def pressed(self, place):
        """Keep the mouse's button pressed, from a pixel on to where it has moved."""
        self.mouse("mousePressed", place)
        try:
            yield
        finally:
            self.mouse("mouseReleased", self._place)

    def key(self, key):
        """Press a key that is named as in the browser, and release it."""
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def place(self, script):
        """Return the pixel in the middle of an element, scrolled into sight; `script` is an expression of it."""
        self.evaluate(f"{script}.scrollIntoView({{block: 'center'}})")
        return self.evaluate(f"(r => [r.x + r.width / 2, r.y + r.height / 2])({script}.getBoundingClientRect())")

    def resize(self, width, height):
        """Give the browser a size [px]; windows are not narrower than 500 px."""
        size = {"width": width, "height": height}
        self.ask("Emulation.setDeviceMetricsOverride", **size, deviceScaleFactor=1, mobile=False)

    def check_view(self, what):
        """Check that the robot is in the picture, below the status bar."""
        left, top, right, bottom, bar = self.evaluate(SEEN)
        assert 0.0 <= left < right <= 1.0 and bar <= top < bottom <= 1.0, f"{what}: {left, top, right, bottom, bar}"

    def picture(self, path):
        """Write what is seen as PNG."""
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))


@contextmanager
def browser(folder, address, width=1280, height=800):
    """Open a page, whose browser has this size [px]."""
    command = [
        CHROMIUM,
        *FLAGS,
        "--remote-debugging-port=0",
        f"--user-data-dir={folder}",
        f"--window-size={width},{height}",
    ]
    with subprocess.Popen([*command, address], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as process:
        try:
            port = _port(folder / "DevToolsActivePort")
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=20.0) as answer:
                pages = [each for each in json.load(answer) if each["type"] == "page"]
            seen = Browser(pages[0]["webSocketDebuggerUrl"])
            seen.resize(width, height)
            yield seen
        finally:
            process.terminate()


def _port(file):
    end = time.monotonic() + 30.0
    while not file.exists() or not file.read_text().strip():
        assert time.monotonic() < end, "Chromium does not start"
        time.sleep(0.1)
    return int(file.read_text().split()[0])
