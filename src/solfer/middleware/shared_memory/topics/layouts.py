"""How messages lie in shared memory: numbers in columns of float64, names and frames in the header of the segment.

What components declare lies there as text, since its fields are not known here.
"""

from typing import Any

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.topics.wire_records import (
    SEPARATE_FIELDS,
    WIRE_COLUMNS,
    FieldsWireRecord,
    NumbersWireRecord,
    TextWireRecord,
    WireRecord,
    fields_text,
)
from solfer.segments.text import Text
from solfer.transport.messages import FieldsMessage, Message, RefusalMessage, type_of


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
        self.texts = texts
        self.shapes = shapes
        self.tuples = tuples
        self.width = WIRE_COLUMNS + sum(int(np.prod(shape)) for shape in shapes.values() if shape is not None)
        self._texts = tuple(texts.items())
        self._arrays = tuple((name, shape) for name, shape in shapes.items() if name not in tuples)

    @classmethod
    def from_message(cls, message: Message) -> "NumbersLayout":
        """Derive the layout from a message."""
        fields = {name: value for name, value in vars(message).items() if name not in SEPARATE_FIELDS}
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
        return NumbersWireRecord(
            message_type, self.texts, self.shapes, tuples=self.tuples, values=values, sender=sender
        )


class TextLayout:
    """Layout of messages of texts, the same for all messages of a type."""

    width = WIRE_COLUMNS + Text.width(2048)  # the longest text [B]

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


class FieldsLayout:
    """Layout of messages of fields that are no longer than a size.

    Args:
        size: Longest text of the fields [B].

    Attributes:
        width: Numbers in a record.
    """

    def __init__(self, size: int):
        self.size = size
        self.width = WIRE_COLUMNS + Text.width(size)

    @classmethod
    def from_message(cls, message: Message) -> "FieldsLayout":
        """Derive the layout from a message.

        Raises:
            MiddlewareError: It is longer than the longest one.
        """
        needed = len(fields_text(message))
        largest = 65536  # [B]
        if needed > largest:
            raise MiddlewareError(f"a message of {needed} bytes of text", expected=f"at most {largest}")
        return cls(min(max(4096, 2 * needed), largest))  # room for twice what the first message of a sender needs

    def fits(self, _message: Message) -> bool:
        """See `NumbersLayout.fits`; whether there is room for a message shows when it is written out."""
        return True

    def header(self) -> dict[str, Any]:
        """See `NumbersLayout.header`."""
        return {"size": self.size}

    @classmethod
    def read(cls, header: dict[str, Any]) -> "FieldsLayout":
        """See `NumbersLayout.read`."""
        return cls(header["size"])

    def bind(self, message_type: type, values: np.ndarray, sender: str) -> WireRecord:
        """See `NumbersLayout.bind`."""
        return FieldsWireRecord(message_type, values, sender)


Layout = NumbersLayout | TextLayout | FieldsLayout


def kind_of(message: str) -> type[NumbersLayout] | type[TextLayout] | type[FieldsLayout]:
    """How the messages of a canonical name lie.

    Raises:
        MiddlewareError: There is no such message.
    """
    kind = type_of(message)
    if kind is FieldsMessage:
        return FieldsLayout
    return TextLayout if kind is RefusalMessage else NumbersLayout
