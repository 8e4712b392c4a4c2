"""How messages lie in shared memory: numbers in columns of float64, names and frames in the header of the segment."""

from typing import Any

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.memory.text import Text
from solfer.middleware.shared_memory.topics.wire_records import (
    FRONT,
    OWN,
    NumbersWireRecord,
    TextWireRecord,
    WireRecord,
)
from solfer.transport.messages import (
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

TEXT_SIZE = 2048
"""Longest text of a message without numbers [B]."""


class NumbersLayout:
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
    def from_message(cls, message: Message) -> "NumbersLayout":
        """Derive the layout from a message."""
        fields = {name: value for name, value in vars(message).items() if name not in OWN}
        tuples = tuple(
            name
            for name, value in fields.items()
            if isinstance(value, tuple) and value and not isinstance(value[0], str)
        )
        texts = {name: value for name, value in fields.items() if isinstance(value, str | tuple) and name not in tuples}
        shapes = {
            name: None if value is None else np.shape(value) for name, value in fields.items() if name not in texts
        }
        return cls(texts, shapes, tuples)

    def fits(self, message: Message) -> bool:
        """Return whether a message has this layout. Tuples of numbers have the same size in all messages of a type."""
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
        """Convert it to the content of a segment's header; `read` is its inverse."""
        return {"texts": self.texts, "shapes": self.shapes, "tuples": self.tuples}

    @classmethod
    def read(cls, header: dict[str, Any]) -> "NumbersLayout":
        """Read the layout from a segment's header."""
        texts = {name: tuple(value) if isinstance(value, list) else value for name, value in header["texts"].items()}
        shapes = {name: None if shape is None else tuple(shape) for name, shape in header["shapes"].items()}
        return cls(texts, shapes, tuple(header["tuples"]))

    def bind(self, message_type: type, values: np.ndarray, sender: str) -> WireRecord:
        """Make a record of this layout on `values`."""
        return NumbersWireRecord(message_type, self.texts, self.shapes, self.tuples, values, sender)


class TextLayout:
    """Layout of messages of texts, the same for all messages of a type."""

    width = FRONT + Text.width(TEXT_SIZE)

    @classmethod
    def from_message(cls, _message: Message) -> "TextLayout":
        """See `NumbersLayout.from_message`."""
        return cls()

    def fits(self, _message: Message) -> bool:
        """See `NumbersLayout.fits`."""
        return True

    def header(self) -> dict[str, Any]:
        """See `NumbersLayout.header`."""
        return {}

    @classmethod
    def read(cls, _header: dict[str, Any]) -> "TextLayout":
        """See `NumbersLayout.read`."""
        return cls()

    def bind(self, message_type: type, values: np.ndarray, sender: str) -> WireRecord:
        """See `NumbersLayout.bind`."""
        return TextWireRecord(message_type, values, sender)


Layout = NumbersLayout | TextLayout


def kind_of(message: str) -> type[NumbersLayout] | type[TextLayout]:
    """How the messages of a canonical name lie.

    Raises:
        MiddlewareError: There is no such message.
    """
    if message not in TYPES:
        raise MiddlewareError(f"no message of shared memory: {message}", expected=f"one of {', '.join(TYPES)}")
    return TextLayout if TYPES[message] is RefusalMessage else NumbersLayout
