"""Signs of life of pages, each with what is pressed on the pad there; no drawing delays them."""

import math
import secrets
from collections.abc import Callable
from functools import partial

from viser import ClientHandle
from viser._messages import RunJavascriptMessage

from solfer_tools.view.server import LIFE_PATH, PageServer


class PageLives:
    """When each page has last shown that its script runs, and what is pressed there.

    Args:
        server: The pages.
        now: Time [s]; any thread may request it.
        press: Gets, in the server's thread, the page and the direction that a sign of life names.
    """

    # A sign of life every 100 ms; a browser lets a page that is not in view send one a second. Viser's own messages
    # wait for the next picture, which may take seconds to draw, and viser knows no key that is held. A sign of life
    # names what is pressed: what a page presses ends with its life. On inputs keys keep their meaning.
    _SCRIPT = """
window.solferPad?.abort();
window.solferPad = new AbortController();
const options = {capture: true, signal: window.solferPad.signal};
const keys = {KeyW: "ahead", ArrowUp: "ahead", KeyS: "back", ArrowDown: "back", KeyA: "left", KeyD: "right",
  KeyQ: "turn left", ArrowLeft: "turn left", KeyE: "turn right", ArrowRight: "turn right", Space: ""};
let pressed = "", held = null;
const place = location.origin.replace(/^http/, "ws") + location.pathname;
const socket = new WebSocket(`${place}%s/%s`);
const live = () => socket.readyState === 1 && socket.send(pressed);
const press = (direction, key = null) => { pressed = direction; held = key; live(); };
const timer = setInterval(live, 100);
socket.onclose = () => clearInterval(timer);
addEventListener("keydown", event => {
  const on = event.target instanceof Element ? event.target : document.body;
  const isInput = on.closest("input:not([type=checkbox]), textarea, [contenteditable=true], [role=dialog]")
    || event.code.startsWith("Arrow") && on.closest("[role=slider], [role=tab]")
    || event.code === "Space" && on.closest("button, input");
  if (!(event.code in keys) || event.ctrlKey || event.metaKey || event.altKey || isInput) return;
  event.preventDefault();
  event.stopImmediatePropagation();  // they would move the camera
  if (!event.repeat) press(keys[event.code], event.code);
}, options);
addEventListener("keyup", event => { if (event.code === held) press(""); }, options);
addEventListener("pointerdown", event => {
  const button = event.target instanceof Element && event.target.closest("[data-solfer-drive]");
  if (button && event.button === 0) press(button.dataset.solferDrive);
}, options);
for (const kind of ["pointerup", "pointercancel", "blur", "visibilitychange", "contextmenu"]) {
  addEventListener(kind, event => { if (pressed) press(""); }, options);
}
"""

    def __init__(self, server: PageServer, now: Callable[[], float], press: Callable[[int, str], None]):
        self._now = now
        self._press = press
        self._newest: dict[int, float] = {}
        keys: dict[int, str] = {}

        @server.viser.on_client_connect
        async def _(client: ClientHandle) -> None:
            number = client.client_id
            keys[number] = secrets.token_urlsafe()
            server.lives[keys[number]] = partial(self._note, number)
            client._websock_connection.queue_message(RunJavascriptMessage(self._SCRIPT % (LIFE_PATH, keys[number])))

        @server.viser.on_client_disconnect
        async def _(client: ClientHandle) -> None:
            server.lives.pop(keys.pop(client.client_id, ""), None)
            self._newest.pop(client.client_id, None)

    def age(self, client: int) -> float:
        """Return the time since the last sign of a page [s]; infinity: there is none."""
        return self._now() - self._newest.get(client, -math.inf)

    def _note(self, client: int, pressed: str | bytes) -> None:
        self._newest[client] = self._now()
        if isinstance(pressed, str) and pressed:
            self._press(client, pressed)
