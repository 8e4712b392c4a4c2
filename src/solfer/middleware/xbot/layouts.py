"""How messages lie in shared memory: numbers in columns of float64, names and frames in the header of the segment."""

import abc
import dataclasses
import json
from typing import Any

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.text import Text
from solfer.pipes.messages import (
    BODY_MESSAGES,
    IMU_MESSAGES,
    JOINT_MESSAGES,
    POINTS,
    REFUSALS,
    VECTOR_MESSAGES,
    WRENCH_MESSAGES,
    BodyMessage,
    ImuMessage,
    JointMessage,
    Message,
    PointsMessage,
    RefusalMessage,
    VectorMessage,
    WrenchMessage,
)

TYPES: dict[str, type] = {
    **dict.fromkeys(JOINT_MESSAGES, JointMessage),
    **dict.fromkeys(BODY_MESSAGES, BodyMessage),
    **dict.fromkeys(VECTOR_MESSAGES, VectorMessage),
    POINTS: PointsMessage,
    **dict.fromkeys(IMU_MESSAGES, ImuMessage),
    **dict.fromkeys(WRENCH_MESSAGES, WrenchMessage),
    REFUSALS: RefusalMessage,
}
"""Class of the messages by their canonical name."""

SENT, STAMP, FRONT = 0, 1, 2
"""Columns in front of those of the message: when it was sent and its own stamp, both [s]; number of these columns."""

OWN = ("stamp", "sender")
"""Fields that every message has, and that are kept apart."""

TEXT_SIZE = 2048
"""Longest text of a message without numbers [B]."""


class Record(abc.ABC):
    """One message in an array of float64.

    Attributes:
        message: The message; it changes when the array does and `decode` is called.
    """

    message: Message

    def __init__(self, values: np.ndarray):
        self._values = values

    @property
    def sent(self) -> float:
        """When it was sent, in the sender's clock [s]."""
        return float(self._values[SENT])

    def encode(self, message: Message, sent: float) -> None:
        """Put a message of the same layout there."""
        self._values[SENT], self._values[STAMP] = sent, message.stamp
        self._encode(message)

    def decode(self) -> Message:
        """What is there, as `message`."""
        self.message.stamp = float(self._values[STAMP])
        self._decode()
        return self.message

    @abc.abstractmethod
    def copy(self) -> Message:
        """What is there, as a message of its own."""

    @abc.abstractmethod
    def _encode(self, message: Message) -> None:
        """Put the fields of a message there."""

    @abc.abstractmethod
    def _decode(self) -> None:
        """Bring `message` up to date."""


class NumbersRecord(Record):
    """A message of numbers; the arrays of `message` are views."""

    def __init__(self, layout: "Numbers", message_type: type, values: np.ndarray, sender: str):
        super().__init__(values)
        self._views, self._tuples = [], []
        start = FRONT
        for name, shape in layout.shapes.items():
            if shape is None:
                continue
            end = start + int(np.prod(shape))
            self._views.append((name, values[start:end].reshape(shape)))
            start = end
        self._tuples = [(name, view) for name, view in self._views if name in layout.tuples]
        self.message = message_type(**layout.texts, **dict(self._views), sender=sender)

    def copy(self) -> Message:
        """See `Record.copy`."""
        tuples = dict(self._tuples)
        arrays = {name: view.copy() for name, view in self._views if name not in tuples}
        return dataclasses.replace(self.decode(), **arrays)

    def _encode(self, message: Message) -> None:
        for name, view in self._views:
            view[...] = getattr(message, name)

    def _decode(self) -> None:
        for name, view in self._tuples:
            setattr(self.message, name, tuple(view.tolist()))


class TextRecord(Record):
    """A message of texts, written out; elements at the end of its tuples that do not fit are left out."""

    def __init__(self, message_type: type, values: np.ndarray, sender: str):
        super().__init__(values)
        self._text, self._type, self._sender = Text(values[FRONT:]), message_type, sender
        self._fields = [field.name for field in dataclasses.fields(message_type) if field.name not in OWN]
        self.message = message_type(*(() for _ in self._fields), sender=sender)

    def copy(self) -> Message:
        """See `Record.copy`."""
        return dataclasses.replace(self.decode())

    def _encode(self, message: Message) -> None:
        parts = [list(getattr(message, name)) for name in self._fields]
        while len(text := json.dumps(parts).encode()) > self._text.size:
            parts = [part[:-1] for part in parts]
        self._text.write(text)

    def _decode(self) -> None:
        for name, part in zip(self._fields, json.loads(self._text.read()), strict=True):
            setattr(self.message, name, tuple(part))


class Numbers:
    """Layout of messages with the same names, frames and sizes.

    Args:
        texts: What does not change from one message to the next: names, frames.
        shapes: Shape of each field of numbers; None: it is not carried.
        tuples: Those of them that are tuples, not arrays.

    Attributes:
        width: Numbers in a record.
    """

    def __init__(self, texts: dict[str, Any], shapes: dict[str, tuple[int, ...] | None], tuples: tuple[str, ...]):
        self.texts, self.shapes, self.tuples = texts, shapes, tuples
        self.width = FRONT + sum(int(np.prod(shape)) for shape in shapes.values() if shape is not None)
        self._texts = tuple(texts.items())
        self._arrays = tuple((name, shape) for name, shape in shapes.items() if name not in tuples)

    @classmethod
    def of(cls, message: Message) -> "Numbers":
        """The layout of a message."""
        fields = {name: value for name, value in vars(message).items() if name not in OWN}
        tuples = tuple(name for name, value in fields.items()
                       if isinstance(value, tuple) and value and not isinstance(value[0], str))
        texts = {name: value for name, value in fields.items()
                 if isinstance(value, str | tuple) and name not in tuples}
        shapes = {name: None if value is None else np.shape(value)
                  for name, value in fields.items() if name not in texts}
        return cls(texts, shapes, tuples)

    def fits(self, message: Message) -> bool:
        """Whether a message has this layout. Tuples of numbers have the same size in all messages of a type."""
        for name, text in self._texts:
            value = getattr(message, name)
            if value is not text and value != text:
                return False
        for name, shape in self._arrays:
            value = getattr(message, name)
            if (None if value is None else value.shape) != shape:
                return False
        return True

    def header(self) -> dict[str, Any]:
        """As it stands in the header of a segment; `read` is its inverse."""
        return {"texts": self.texts, "shapes": self.shapes, "tuples": self.tuples}

    @classmethod
    def read(cls, header: dict[str, Any]) -> "Numbers":
        """The layout that a header tells."""
        texts = {name: tuple(value) if isinstance(value, list) else value for name, value in header["texts"].items()}
        shapes = {name: None if shape is None else tuple(shape) for name, shape in header["shapes"].items()}
        return cls(texts, shapes, tuple(header["tuples"]))

    def bind(self, message_type: type, values: np.ndarray, sender: str) -> Record:
        """A message of this layout in `values`."""
        return NumbersRecord(self, message_type, values, sender)


class Texts:
    """Layout of messages of texts, which any message of the type has."""

    width = FRONT + Text.width(TEXT_SIZE)

    @classmethod
    def of(cls, _message: Message) -> "Texts":
        """The layout of a message."""
        return cls()

    def fits(self, _message: Message) -> bool:
        """Whether a message has this layout."""
        return True

    def header(self) -> dict[str, Any]:
        """See `Numbers.header`."""
        return {}

    @classmethod
    def read(cls, _header: dict[str, Any]) -> "Texts":
        """See `Numbers.read`."""
        return cls()

    def bind(self, message_type: type, values: np.ndarray, sender: str) -> Record:
        """See `Numbers.bind`."""
        return TextRecord(message_type, values, sender)


Layout = Numbers | Texts


def kind_of(message: str) -> type[Numbers] | type[Texts]:
    """How the messages of a canonical name lie.

    Raises:
        MiddlewareError: There is no such message.
    """
    if message not in TYPES:
        raise MiddlewareError(f"no message of shared memory: {message}", expected=f"one of {', '.join(TYPES)}")
    return Texts if TYPES[message] is RefusalMessage else Numbers
