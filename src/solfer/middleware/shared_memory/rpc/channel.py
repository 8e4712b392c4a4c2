"""The calls of one client to one service, between two processes: a ring in each direction."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from solfer.errors import MiddlewareError
from solfer.segments.header import CACHE_LINE
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.segments.text import Text

REQUEST_SIZE = 16384
"""Longest request [B]."""

REPLY_SIZE = 131072
"""Longest reply [B]."""

DONE = "done"
FAILED = "failed"


def interface_of(interface: str, request: type, reply: type) -> bytes:
    """Encode what both ends of a service have to agree on: its type, and the names of its fields."""
    fields = [sorted(field.name for field in dataclasses.fields(each)) for each in (request, reply)]
    return json.dumps([interface, *fields]).encode()


class MessageRing:
    """One direction of a channel: numbered texts, each of which is read once.

    Args:
        memory: Where the ring is, of `size` bytes.
        longest: Longest text [B].
        count: Texts that may wait.
    """

    def __init__(self, memory: memoryview, longest: int, count: int):
        self._ring = Ring(memory, self._width(longest), count, refuse=True)
        self._text = Text(self._ring.values[1:])

    @classmethod
    def size(cls, longest: int, count: int) -> int:
        """Compute the memory that is needed [B]."""
        return Ring.size(cls._width(longest), count)

    def send(self, number: int, content: Any) -> bool:
        """Write `content`, which JSON has to know; returns False if there is no room at present.

        Raises:
            MiddlewareError: It is longer than the longest text.
        """
        self._ring.values[0] = number
        self._text.write(json.dumps(content, default=_plain).encode())
        return self._ring.write(number)

    def resume(self) -> None:
        """Continue where a writer that has ended stopped."""
        self._ring.resume()

    def receive(self) -> tuple[int, Any] | None:
        """Read the next number and its content; None if there is none."""
        if not self._ring.read():
            return None
        return int(self._ring.values[0]), json.loads(self._text.read())

    @staticmethod
    def _width(longest: int) -> int:
        return 1 + Text.width(longest)  # the number of a call is in front of its text


class RpcChannel:
    """Requests in one direction and replies in the other.

    Attributes:
        segment: The client's segment.
        requests: From the client.
        replies: From the service.
    """

    KIND = "calls"

    DEPTH = 4
    """Calls of the client that may wait for the service."""

    def __init__(self, segment: Segment):
        self.segment = segment
        size = -(-MessageRing.size(REQUEST_SIZE, self.DEPTH) // CACHE_LINE) * CACHE_LINE
        self.requests = MessageRing(segment.data[:size], REQUEST_SIZE, self.DEPTH)
        self.replies = MessageRing(segment.data[size:], REPLY_SIZE, 2)

    @classmethod
    def open(cls, path: Path, interface: bytes) -> "RpcChannel":
        """Open a client's end.

        Raises:
            MiddlewareError: The segment cannot be made.
        """
        size = MessageRing.size(REQUEST_SIZE, cls.DEPTH) + CACHE_LINE + MessageRing.size(REPLY_SIZE, 2)
        return cls(Segment.create(path, cls.KIND, interface, size=size))

    @classmethod
    def join(cls, path: Path, interface: bytes) -> "RpcChannel":
        """Open the service's end.

        Raises:
            MiddlewareError: There is no such segment, or its client expects another interface.
        """
        channel = cls(Segment.attach(path, cls.KIND, interface, writable=True))
        channel.replies.resume()
        return channel


def _plain(value: Any) -> Any:
    """Convert numbers and arrays of NumPy to those of Python."""
    if not isinstance(value, np.generic | np.ndarray):
        raise MiddlewareError(f"a {type(value).__name__} cannot be sent", expected="numbers, texts and lists of them")
    return value.tolist()


def packed(value: Any) -> dict[str, Any]:
    """Convert a dataclass to a mapping of its fields."""
    return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}


def unpacked(cls: type, fields: dict[str, Any]) -> Any:
    """Make a dataclass of packed fields; lists become tuples."""
    try:
        return cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})
    except TypeError as error:
        raise MiddlewareError(
            f"{cls.__name__} cannot be made of {', '.join(fields)}",
            expected=f"the fields {', '.join(field.name for field in dataclasses.fields(cls))}",
        ) from error
