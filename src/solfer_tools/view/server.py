"""The server of the page: on this machine alone, and for those alone that know its address."""

import asyncio
import http
import logging
import re
import secrets
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any
from unittest.mock import patch

import rich
import viser
import websockets.asyncio.server
from viser import _messages
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode
from websockets.http11 import Request, Response
from websockets.protocol import Event
from websockets.typing import Subprotocol

from solfer.errors import MiddlewareError, described
from solfer.throttle import Throttle
from solfer_tools.view.incoming import IncomingMessages

HOST = "127.0.0.1"

LIFE_PATH = "life"
"""Path of the websockets by which pages show that they live."""

logger = logging.getLogger(__name__)

throttle = Throttle(logger)


class _OneLine(logging.Handler):
    """Logs in one line, once a second, what a library logs for each connection or message, also with a traceback."""

    def emit(self, record: logging.LogRecord) -> None:
        """See `logging.Handler.emit`."""
        error = record.exc_info[1] if record.exc_info else None
        _log(record.name, record.getMessage(), error)


def _log(key: str, text: str, error: BaseException | None) -> None:
    throttle.warning(key, "%s%s", text.partition("\n")[0], "" if error is None else f": {described(error)}")


def quiet_logger(name: str) -> logging.Logger:
    """Return the logger of a library of which one line a second is logged."""
    made = logging.getLogger(name)
    made.propagate = False
    made.setLevel(logging.WARNING)
    made.handlers = [_OneLine()]
    return made


Handler = Callable[[ServerConnection], Awaitable[None]]
Process = Callable[[ServerConnection, Request], Response | None | Awaitable[Response | None]]


class PageServer:
    """Serves a page at an address with a random token, to browsers of this machine.

    A request without the token, for another host, or from a page of another origin gets nothing.

    Args:
        port: Its port, or the next one that is free [0: any].

    Attributes:
        viser: What is on the page.
        address: Address of the page.
        incoming: Checks what pages send.
        routes: What serves websockets of other programs, by the path below the token.
        lives: What gets each sign of life, in the server's thread, by the random key of a page.

    Raises:
        MiddlewareError: It cannot be served.
    """

    def __init__(self, port: int = 8080):
        rich.get_console().quiet = True  # viser prints addresses without the token
        self._token = secrets.token_urlsafe(24)
        self._is_guarded = False
        self.lives: dict[str, Callable[[str | bytes], None]] = {}
        self.routes: dict[str, Handler] = {}
        # viser has no hook for requests
        with patch.object(websockets.asyncio.server, "serve", self._guarded(websockets.asyncio.server.serve)):
            self.viser = viser.ViserServer(HOST, port, label="solfer", verbose=False)
        if not self._is_guarded:
            self.viser.stop()
            raise MiddlewareError("this version of viser cannot be guarded", expected="that of requirements-view.txt")
        self.incoming = IncomingMessages(self.viser)
        self.address = f"http://localhost:{self.viser.get_port()}/{self._token}/"

    @property
    def connection(self) -> "viser.infra.WebsockServer":
        """What carries messages to all pages."""
        return self.viser._websock_server

    def send(self, message: _messages.Message) -> None:
        """Send a message to all pages, those to come included."""
        self.connection.queue_message(message)

    def close(self) -> None:
        """End it."""
        self.viser.stop()

    def _guarded(self, serve: Callable[..., Any]) -> Callable[..., Any]:
        """Return a `serve` that checks each request by `_is_own` first, and receives signs of life."""
        headers = {  # the page is neither stored nor shown inside of another one, and its address is not passed on
            "Cache-Control": "no-store",
            "Content-Security-Policy": "frame-ancestors 'none'",
            "Referrer-Policy": "no-referrer",
        }

        def guarded(handler: Handler, *arguments: Any, process_request: Process, **options: Any) -> Any:
            self._is_guarded = True

            def process(connection: ServerConnection, request: Request) -> Any:
                request.path = request.path.partition("?")[0]
                if not self._is_own(request):
                    return _empty(http.HTTPStatus.FORBIDDEN)
                request.path = request.path.removeprefix(f"/{self._token}") or "/"
                try:
                    response = process_request(connection, request)
                except OSError:  # a path that no file can have
                    response = _empty(http.HTTPStatus.NOT_FOUND)
                except LookupError:  # of websockets: a header that is there twice
                    response = _empty(http.HTTPStatus.BAD_REQUEST)
                if isinstance(response, Response):
                    response.headers.update(headers)
                return response

            async def handle(connection: ServerConnection) -> None:
                assert connection.request is not None
                kind, _, key = connection.request.path.strip("/").partition("/")
                if kind in self.routes:
                    return await self.routes[kind](connection)
                if kind != LIFE_PATH:
                    receive = partial(self.incoming.receive, connection, connection.recv)
                    connection.recv = receive  # type: ignore[method-assign, assignment]
                    return await handler(connection)
                with suppress(ConnectionClosed):
                    async for sign in connection:
                        if key not in self.lives:
                            return
                        self.lives[key](sign)
                        await asyncio.sleep(0.0)  # as for other messages: a flood leaves their turn to others

            asyncio.get_running_loop().set_exception_handler(
                lambda _, context: _log("loop", context["message"], context.get("exception"))
            )
            quiet_logger("asyncio")  # it warns of each message to a connection that has ended
            options |= {
                "backlog": 1024,  # connections that wait; one beyond them is repeated by its sender after a second
                "max_size": 65536,  # [bytes] of a message; a longer one closes its connection
                "logger": quiet_logger(f"{__name__}.websockets"),
                "select_subprotocol": _subprotocol,
                "create_connection": _PageConnection,
            }
            return serve(handle, *arguments, process_request=process, **options)

        return guarded

    def _is_own(self, request: Request) -> bool:
        """Return whether a request has the token, and is for this host, from an origin that may make it.

        The port may be another one, by which a tunnel leads here.
        """
        _, token, kind, *_ = [*request.path.split("/"), "", ""]
        headers = request.headers
        hosts = headers.get_all("Host")
        origins = [f"http://{host}" for host in hosts]
        is_routed = kind in self.routes
        if is_routed:  # Foxglove in the browser, and on the desktop
            origins += ("https://app.foxglove.dev", "file://")
        return (
            secrets.compare_digest(token.encode(errors="surrogateescape"), self._token.encode())
            and len(hosts) == 1
            and re.fullmatch(rf"(localhost|{re.escape(HOST)}):[1-9][0-9]{{0,4}}", hosts[0]) is not None
            and all(origin in origins for origin in headers.get_all("Origin"))
            and ("Upgrade" not in headers or "Origin" in headers or is_routed)
        )


def _empty(status: http.HTTPStatus) -> Response:
    return Response(status, status.phrase, Headers(), b"")


class _PageConnection(ServerConnection):
    """Ends when nothing else bounds what is kept: unread answers to pings, or fragments of one message."""

    _unread = 0
    _fragments = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See `ServerConnection.connection_made`."""
        # what is decoded at once [bytes]: 256 KiB of empty messages would keep others waiting for 0.4 to 1 s
        transport.max_size = 4096  # type: ignore[attr-defined]  # of asyncio
        super().connection_made(transport)

    def process_event(self, event: Event) -> None:
        """See `ServerConnection.process_event`."""
        if isinstance(event, Frame) and event.opcode is Opcode.PING:
            self._unread = self._unread + 1 if self.transport.get_write_buffer_size() else 0
        elif isinstance(event, Frame) and event.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            self._fragments = 0 if event.fin else self._fragments + 1
        if max(self._unread, self._fragments) > 1000:
            self.transport.abort()
        super().process_event(event)


def _subprotocol(_: ServerConnection, offered: Sequence[Subprotocol]) -> Subprotocol | None:
    return next((each for each in offered if each.startswith(("viser-v", "foxglove."))), None)
