"""One message in an array of float64."""

import abc
import dataclasses
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from solfer.middleware.shared_memory.memory.text import Text
from solfer.transport.messages import Message

SENT, STAMP, FRONT = 0, 1, 2
"""Columns in front of those of the message: when it was sent and its own stamp, both [s]; number of these columns."""

OWN = ("stamp", "sender")
"""Fields that every message has, and that are kept apart."""


class WireRecord(abc.ABC):
    """One message in an array of float64.

    Attributes:
        message: The message; it changes when the array does and `decode` is called.
    """

    message: Message

    def __init__(self, values: np.ndarray):
        self._front: Any = memoryview(values)[:FRONT]

    @property
    def sent(self) -> float:
        """When it was sent, in the sender's clock [s]."""
        return self._front[SENT]

    def encode(self, message: Message, sent: float) -> None:
        """Write a message of the same layout."""
        front = self._front
        front[SENT], front[STAMP] = sent, message.stamp
        self._encode(message)

    def decode(self) -> Message:
        """Bring `message` up to date and return it."""
        message = self.message
        message.stamp = self._front[STAMP]
        self._decode()
        return message

    @abc.abstractmethod
    def copy(self) -> Message:
        """Return the content as a message of its own."""

    @abc.abstractmethod
    def _encode(self, message: Message) -> None:
        """Write the fields of a message."""

    @abc.abstractmethod
    def _decode(self) -> None:
        """Bring `message` up to date."""


class NumbersWireRecord(WireRecord):
    """A message of numbers; the arrays of `message` are views.

    Args:
        message_type: Its class.
        texts: Fields that are texts.
        shapes: Shapes of the fields that are numbers, in their order; None: not carried.
        tuples: Those of them that are tuples.
        values: The record.
        sender: Name of the node that sends it.
    """

    def __init__(
        self,
        message_type: type,
        texts: Mapping[str, Any],
        shapes: Mapping[str, tuple[int, ...] | None],
        tuples: tuple[str, ...],
        values: np.ndarray,
        sender: str,
    ):
        super().__init__(values)
        self._views: list[tuple[str, np.ndarray]] = []
        start = FRONT
        for name, shape in shapes.items():
            if shape is None:
                continue
            end = start + int(np.prod(shape))
            self._views.append((name, values[start:end].reshape(shape)))
            start = end
        self._tuples = [(name, view) for name, view in self._views if name in tuples]
        self.message = message_type(**texts, **dict(self._views), sender=sender)

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        tuples = dict(self._tuples)
        arrays: dict[str, Any] = {name: view.copy() for name, view in self._views if name not in tuples}
        return dataclasses.replace(self.decode(), **arrays)

    def _encode(self, message: Message) -> None:
        for name, view in self._views:
            view[...] = getattr(message, name)

    def _decode(self) -> None:
        for name, view in self._tuples:
            setattr(self.message, name, tuple(view.tolist()))


class TextWireRecord(WireRecord):
    """A message of texts, written out; elements at the end of its tuples that do not fit are left out."""

    def __init__(self, message_type: type, values: np.ndarray, sender: str):
        super().__init__(values)
        self._text, self._type, self._sender = Text(values[FRONT:]), message_type, sender
        self._fields = [field.name for field in dataclasses.fields(message_type) if field.name not in OWN]
        self.message = message_type(*(() for _ in self._fields), sender=sender)

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return dataclasses.replace(self.decode())

    def _encode(self, message: Message) -> None:
        parts = [list(getattr(message, name)) for name in self._fields]
        while len(text := json.dumps(parts).encode()) > self._text.size:
            parts = [part[:-1] for part in parts]
        self._text.write(text)

    def _decode(self) -> None:
        for name, part in zip(self._fields, json.loads(self._text.read()), strict=True):
            setattr(self.message, name, tuple(part))
