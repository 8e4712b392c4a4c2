"""Signs of life of pages, which no drawing delays."""

import math
import secrets
from collections.abc import Callable

from viser import ClientHandle
from viser._messages import RunJavascriptMessage

from solfer_tools.view.server import LIFE_PATH, PageServer


class PageLives:
    """When each page has last shown that its script runs.

    Args:
        server: The pages.
        now: Time [s]; any thread may request it.
    """

    # A sign of life every 100 ms; a browser lets a page that is not in view send one a second. Viser's own messages
    # wait for the next picture, which may take seconds to draw.
    _SCRIPT = """
const place = location.origin.replace(/^http/, "ws") + location.pathname;
const socket = new WebSocket(`${place}%s/%s`);
const timer = setInterval(() => socket.readyState === 1 && socket.send(""), 100);
socket.onclose = () => clearInterval(timer);
"""

    def __init__(self, server: PageServer, now: Callable[[], float]):
        self._now = now
        self._newest: dict[int, float] = {}
        keys: dict[int, str] = {}

        @server.viser.on_client_connect
        async def _(client: ClientHandle) -> None:
            number = client.client_id
            keys[number] = secrets.token_urlsafe()
            server.lives[keys[number]] = lambda: self._note(number)
            client._websock_connection.queue_message(RunJavascriptMessage(self._SCRIPT % (LIFE_PATH, keys[number])))

        @server.viser.on_client_disconnect
        async def _(client: ClientHandle) -> None:
            server.lives.pop(keys.pop(client.client_id, ""), None)
            self._newest.pop(client.client_id, None)

    def age(self, client: int) -> float:
        """Return the time since the last sign of a page [s]; infinity: there is none."""
        return self._now() - self._newest.get(client, -math.inf)

    def _note(self, client: int) -> None:
        self._newest[client] = self._now()
