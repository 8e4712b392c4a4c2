"""Live parameters of all parts that offer them."""

import json
import math
from collections.abc import Iterable, Mapping
from concurrent.futures import Future
from typing import Any

from solfer.interfaces.declaration import Accepted
from solfer.transport import Middleware
from solfer.transport.parameters import (
    GET_INTERFACE,
    GET_PARAMETERS,
    SET_INTERFACE,
    SET_PARAMETERS,
    GetParameters,
    ParametersReply,
    SetParameters,
)
from solfer_tools.view.commands.requests import PageRequests

ATTEMPTS = 10
"""How often a part is requested its parameters: it may report before it offers them."""


class KnownParameters:
    """Requests the parameters of each part that reports its health, until they are known.

    Args:
        middleware: Has their services.

    Attributes:
        known: What is known, by part.
    """

    def __init__(self, middleware: Middleware):
        self._middleware = middleware
        self.known: dict[str, ParametersReply] = {}
        self._pending: dict[str, Future[ParametersReply]] = {}
        self._left: dict[str, int] = {}
        self._next: dict[str, float] = {}

    def update(self, parts: Iterable[str]) -> None:
        """Send requests, and take the replies that are there."""
        pause = 2.0  # [s] until the next request
        now = self._middleware.now()
        for part in parts:
            if part in self._pending:
                self._take(part)
            elif self._left.setdefault(part, ATTEMPTS) and now >= self._next.get(part, -math.inf):
                self._left[part] -= 1
                self._next[part] = now + pause
                service = self._middleware.resolve(f"{part}/{GET_PARAMETERS}")
                answer = self._middleware.request(service, GET_INTERFACE, GetParameters(), ParametersReply, pause)
                self._pending[part] = answer

    def forget(self, part: str) -> None:
        """Request a part's parameters again, since they have changed."""
        self._left[part] = ATTEMPTS
        self._next[part] = -math.inf

    def change(self, requests: PageRequests, part: str, values: Mapping[str, Any]) -> None:
        """Change parameters of a part, all or none; other values than texts are written as JSON."""
        texts = (value if isinstance(value, str) else json.dumps(value) for value in values.values())
        request = SetParameters(tuple(values), tuple(texts))
        requests.call(f"{part}/{SET_PARAMETERS}", SET_INTERFACE, request, Accepted, lambda _: self.forget(part))

    def _take(self, part: str) -> None:
        if self._pending[part].done():
            answer = self._pending.pop(part)
            if answer.exception() is None:
                self._left[part] = 0
                self.known[part] = answer.result()
