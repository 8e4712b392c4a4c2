"""One message in an array of float64."""

import abc
import dataclasses
import json
from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from solfer.segments.text import Text
from solfer.transport.messages import JOINT_FIELDS, FieldsMessage, JointMessage, Message, copied

SENT_COLUMN = 0
"""Column in front of those of the message: when it was sent [s]."""

STAMP_COLUMN = 1
"""Column in front of those of the message: its own stamp [s]."""

WIRE_COLUMNS = 2
"""Number of these columns."""

SEPARATE_FIELDS = ("stamp", "sender", "rows", "block")
"""Fields that are kept apart: those that every message has, and how its numbers lie."""


class WireRecord(abc.ABC):
    """One message in an array of float64.

    Attributes:
        message: The message; it changes when the array does and `decode` is called.
        front: The columns in front of those of the message; live.
        block: All numbers of a JointMessage as rows of one array, which takes less time to copy; None: another message.
        rows: What the rows of `block` are.
    """

    block: np.ndarray | None = None
    rows: tuple[str, ...] = ()

    message: Message
    _changes = True
    """Whether `message` lacks what changes in the array until `_decode` is called."""

    def __init__(self, values: np.ndarray):
        self.front: Any = memoryview(values)[:WIRE_COLUMNS]

    @abc.abstractmethod
    def encode(self, message: Message) -> None:
        """Write a message of the same layout, behind the columns in front."""

    def decode(self) -> Message:
        """Bring `message` up to date and return it."""
        message = self.message
        message.__dict__["stamp"] = self.front[STAMP_COLUMN]  # to assign one, a message looks for its arrays
        if self._changes:
            self._decode()
        return message

    @abc.abstractmethod
    def copy(self) -> Message:
        """Return the content as a message of its own."""

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
        *,
        sender: str,
    ):
        super().__init__(values)
        self._views: list[tuple[str, np.ndarray]] = []
        start = WIRE_COLUMNS
        for name, shape in shapes.items():
            if shape is None:
                continue
            end = start + int(np.prod(shape))
            self._views.append((name, values[start:end].reshape(shape)))
            start = end
        self._tuples = [(name, view) for name, view in self._views if name in tuples]
        self.message = message_type(**texts, **dict(self._views), sender=sender)
        self._changes = bool(self._tuples)
        if isinstance(self.message, JointMessage):
            self._lay(self.message, values[WIRE_COLUMNS:start])

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return copied(self.decode())

    def encode(self, message: Any) -> None:
        """See `WireRecord.encode`."""
        for name, view in self._views:
            view[...] = getattr(message, name)

    def _lay(self, message: JointMessage, values: np.ndarray) -> None:
        """Let the numbers of a message be rows of one array, if there is one for each name."""
        size = len(message.names)
        rows = (*(name for name, _ in self._views if name in JOINT_FIELDS), *message.interfaces)
        if all(view.shape[-1] == size for _, view in self._views) and len(rows) * size == len(values):
            self.rows = rows
            self.block = values.reshape(len(rows), size)
            message.lay(rows, self.block)

    def _decode(self) -> None:
        for name, view in self._tuples:
            setattr(self.message, name, tuple(view.tolist()))


class TextWireRecord(WireRecord):
    """A message of texts, written out; elements at the end of its tuples that do not fit are left out."""

    def __init__(self, message_type: type, values: np.ndarray, sender: str):
        super().__init__(values)
        self._text = Text(values[WIRE_COLUMNS:])
        self._type = message_type
        self._sender = sender
        self._fields = [field.name for field in dataclasses.fields(message_type) if field.name not in SEPARATE_FIELDS]
        self.message = message_type(*(() for _ in self._fields), sender=sender)

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return dataclasses.replace(self.decode())

    def encode(self, message: Message) -> None:
        """See `WireRecord.encode`."""
        parts = [list(getattr(message, name)) for name in self._fields]
        while len(text := json.dumps(parts).encode()) > self._text.size:
            parts = [part[:-1] for part in parts]
        self._text.write(text)

    def _decode(self) -> None:
        for name, part in zip(self._fields, json.loads(self._text.read()), strict=True):
            setattr(self.message, name, tuple(part))


class FieldsWireRecord(WireRecord):
    """A message of fields, written out. See `TextWireRecord`."""

    message: FieldsMessage

    def __init__(self, message_type: type, values: np.ndarray, sender: str):
        super().__init__(values)
        self._text = Text(values[WIRE_COLUMNS:])
        self.message = message_type({}, sender=sender)

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return dataclasses.replace(self.decode())

    def encode(self, message: Message) -> None:
        """See `WireRecord.encode`."""
        self._text.write(fields_text(message))

    def _decode(self) -> None:
        self.message.fields = json.loads(self._text.read())


def fields_text(message: Message) -> bytes:
    """Write out the fields of a FieldsMessage."""
    return json.dumps(cast(FieldsMessage, message).fields).encode()
