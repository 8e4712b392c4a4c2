"""Relays Foxglove's clients behind the token of the page."""

import asyncio
import json
import secrets
from contextlib import suppress

from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from solfer_tools.view.server import PageServer

FOXGLOVE = "foxglove"
"""Path of the server below the token of the page."""


class FoxgloveRelay:
    """Passes on what clients and a server behind it send.

    Args:
        server: The page, which checks token and origin.
        behind: Address of the server behind it.

    Attributes:
        address: Address for clients.
        behind: See above.
    """

    def __init__(self, server: PageServer, behind: str):
        self.behind = behind
        self.address = f"{server.address.replace('http', 'ws', 1)}{FOXGLOVE}"
        self._secret = secrets.token_urlsafe()
        self._relayed: set[int] = set()
        server.routes[FOXGLOVE] = self._relay

    def knows(self, client: int, request: str | None = None) -> bool:
        """Return whether a client of the server behind it is relayed, which the identity of a first request shows."""
        if request == self._secret:
            self._relayed.add(client)
        return client in self._relayed

    async def _relay(self, connection: ServerConnection) -> None:
        protocols = [connection.subprotocol] if connection.subprotocol else None
        async with connect(self.behind, subprotocols=protocols, max_size=None, proxy=None) as server:
            await server.send(json.dumps({"op": "getParameters", "parameterNames": [], "id": self._secret}))
            async for message in server:
                if isinstance(message, str) and self._secret in message:
                    break
                await connection.send(message)
            pause = 0.001  # [s]; the server behind takes messages in threads that delay the page
            both = [
                asyncio.create_task(_pass_on(connection, server, pause)),
                asyncio.create_task(_pass_on(server, connection)),
            ]
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            for each in both:
                each.cancel()


async def _pass_on(
    source: ServerConnection | ClientConnection, sink: ServerConnection | ClientConnection, pause: float = 0.0
) -> None:
    with suppress(ConnectionClosed):
        async for message in source:
            await sink.send(message)
            await asyncio.sleep(pause)
