"""One message in an array of float64."""

import abc
import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

import msgspec
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

_pack = msgspec.msgpack.Encoder().encode
_unpack = msgspec.msgpack.Decoder(ext_hook=lambda _code, text: json.loads(bytes(text))).decode


class WireRecord(abc.ABC):
    """One message in an array of float64.

    Attributes:
        message: The message; it changes when the array does and `decode` is called.
        front: The columns in front of those of the message; live.
        block: All numbers of a JointMessage as rows of one array, which takes less time to copy; None: another message.
        rows: What the rows of `block` are.
        views: Arrays of numbers by the names of their fields; empty: the message is written out, by `encode`.
        attributes: Those of `message`: to assign one, a message looks for its arrays.
        changes: Whether `message` lacks what changes in the array until `update` is called.
    """

    block: np.ndarray | None = None
    rows: tuple[str, ...] = ()
    views: Sequence[tuple[str, np.ndarray]] = ()
    changes = True

    def __init__(self, values: np.ndarray, message: Message):
        self.front: Any = memoryview(values)[:WIRE_COLUMNS]
        self.message = message
        self.attributes: dict[str, Any] = vars(message)

    @abc.abstractmethod
    def encode(self, message: Message) -> bool:
        """Write a message behind the columns in front, where it has no `views`; return whether there is room for it."""

    def decode(self) -> Message:
        """Bring `message` up to date and return it."""
        self.attributes["stamp"] = self.front[STAMP_COLUMN]
        if self.changes:
            self.update()
        return self.message

    @abc.abstractmethod
    def copy(self) -> Message:
        """Return the content as a message of its own."""

    @abc.abstractmethod
    def update(self) -> None:
        """Bring `message` up to date, beside its stamp and its views."""


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
        views: list[tuple[str, np.ndarray]] = []
        start = WIRE_COLUMNS
        for name, shape in shapes.items():
            if shape is None:
                continue
            end = start + int(np.prod(shape))
            views.append((name, values[start:end].reshape(shape)))
            start = end
        self._tuples = [(name, view) for name, view in views if name in tuples]
        super().__init__(values, message_type(**texts, **dict(views), sender=sender))
        self.views = views
        self.changes = bool(self._tuples)
        if isinstance(self.message, JointMessage):
            self._lay(self.message, values[WIRE_COLUMNS:start])

    def encode(self, _message: Message) -> bool:
        """See `WireRecord.encode`: a message without `views` has no numbers."""
        return True

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return copied(self.decode())

    def _lay(self, message: JointMessage, values: np.ndarray) -> None:
        """Let the numbers of a message be rows of one array, if there is one for each name."""
        size = len(message.names)
        rows = (*(name for name, _ in self.views if name in JOINT_FIELDS), *message.interfaces)
        if all(view.shape[-1] == size for _, view in self.views) and len(rows) * size == len(values):
            self.rows = rows
            self.block = values.reshape(len(rows), size)
            message.lay(rows, self.block)

    def update(self) -> None:
        """See `WireRecord.update`."""
        for name, view in self._tuples:
            setattr(self.message, name, tuple(view.tolist()))


class TextWireRecord(WireRecord):
    """A message of texts, written out; elements at the end of its tuples that do not fit are left out."""

    def __init__(self, message_type: type, values: np.ndarray, sender: str):
        self._fields = [field.name for field in dataclasses.fields(message_type) if field.name not in SEPARATE_FIELDS]
        super().__init__(values, message_type(*(() for _ in self._fields), sender=sender))
        self._text = Text(values[WIRE_COLUMNS:])

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return dataclasses.replace(self.decode())

    def encode(self, message: Message) -> bool:
        """See `WireRecord.encode`."""
        parts = [list(getattr(message, name)) for name in self._fields]
        while len(text := json.dumps(parts).encode()) > self._text.size:
            parts = [part[:-1] for part in parts]
        self._text.write(text)
        return True

    def update(self) -> None:
        """See `WireRecord.update`."""
        for name, part in zip(self._fields, json.loads(self._text.read()), strict=True):
            setattr(self.message, name, tuple(part))


class FieldsWireRecord(WireRecord):
    """A message of fields, packed by MessagePack."""

    message: FieldsMessage

    def __init__(self, message_type: type, values: np.ndarray, sender: str):
        super().__init__(values, message_type({}, sender=sender))
        self._text = Text(values[WIRE_COLUMNS:])

    def copy(self) -> Message:
        """See `WireRecord.copy`."""
        return dataclasses.replace(self.decode())

    def encode(self, message: Message) -> bool:
        """See `WireRecord.encode`."""
        text = fields_text(message)
        has_room = len(text) <= self._text.size
        if has_room:
            self._text.write(text)
        return has_room

    def update(self) -> None:
        """See `WireRecord.update`."""
        self.message.fields = _unpack(self._text.read())


def fields_text(message: Message) -> bytes:
    """Pack the fields of a FieldsMessage; what MessagePack does not hold, such as wide integers, is JSON in it."""
    fields = cast(FieldsMessage, message).fields
    try:
        return _pack(fields)
    except (OverflowError, TypeError, UnicodeEncodeError):
        return _pack(msgspec.msgpack.Ext(0, json.dumps(fields).encode()))
