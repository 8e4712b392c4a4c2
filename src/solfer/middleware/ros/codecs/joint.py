"""Joint-space messages to named numbers and back.

The names of a joint-space message hardly ever change, so its bytes are compared with those of the last message
instead of being decoded again: all but the numbers, where these lie in rows, else those of the names.
"""

import struct
from itertools import pairwise

import numpy as np

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.base import Codec, packed_class
from solfer.middleware.ros.codecs.interfaces import message_class
from solfer.middleware.ros.codecs.packed_message import MESSAGE_HEADER, MESSAGE_LENGTH, PackedMessage
from solfer.transport.messages import ANY_INTERFACE, JOINT_MESSAGES, JointMessage

NO_VALUES = np.zeros(0)

FLOAT64 = np.dtype("<f8")


class JointLayout:
    """What messages share with one that was decoded: all between their header and their end, but the numbers.

    Args:
        packed: The message.
        start: Offset of what follows its header.
        message: The same, decoded.
        places: Offset of the numbers of each field that it carries, at the same distance from each to the next.

    Attributes:
        names: Names of the DoFs.
        component: Name of the component whose message it is.
        rows: Names of the fields that it carries.
    """

    def __init__(self, packed: bytes, start: int, message: JointMessage, places: dict[str, int]):
        self.names = message.names
        self.component = message.component
        self.rows = tuple(places)
        offsets = tuple(places.values())
        size = FLOAT64.itemsize * len(message.names)
        self._shape = (len(offsets), len(message.names))
        self._first = offsets[0]
        self._strides = (offsets[1] - offsets[0] if len(offsets) > 1 else size, FLOAT64.itemsize)
        begins = (start, *(offset + size for offset in offsets))
        ends = (*offsets, len(packed))
        self._constants = [(packed[begin:end], begin) for begin, end in zip(begins, ends, strict=True)]

    @classmethod
    def of(cls, packed: bytes, start: int, message: JointMessage, places: dict[str, int]) -> "JointLayout | None":
        """Return the layout of a message, if its numbers lie in rows."""
        distances = {after - before for before, after in pairwise(places.values())}
        in_rows = message.names and places and len(distances) < 2 and not message.interfaces
        return cls(packed, start, message, places=places) if in_rows else None

    def read(self, packed: bytes) -> np.ndarray | None:
        """Return the numbers of a message of the same length, and with a header of the same length, row by row.

        Returns:
            The rows, shape (len(rows), len(names)); None: the message is laid out otherwise.
        """
        for constant, begin in self._constants:
            if not packed.startswith(constant, begin):
                return None
        return np.ndarray(self._shape, FLOAT64, packed, self._first, self._strides).copy()


class JointCodec(Codec):
    """sensor_msgs/JointState and solfer/JointCommand: a header, names, and arrays, empty or as long as the names.

    The latter has further interfaces behind them: their names, and one array for all; then the name of the component.

    Args:
        message: Canonical name of the message.
    """

    messages = JOINT_MESSAGES

    def __init__(self, message: str):
        self._fields = JOINT_MESSAGES[message]
        self._open = message == ANY_INTERFACE
        self.ros_class = packed_class(message_class(message))
        self._layout: tuple[tuple[str, ...], list[int], tuple[str, ...], str] | None = None
        self._frame = PackedMessage(b"")
        self._arrays: list[np.ndarray] = []
        self._decoded: tuple[tuple[str, ...], bytes] = ((), _pack_names(()))
        self._interfaces: tuple[tuple[str, ...], bytes] = self._decoded
        self._component: tuple[str, bytes] = ("", _pack_text(""))
        self._layouts: dict[tuple[int, int], JointLayout] = {}

    @classmethod
    def of(cls, message: str) -> "JointCodec":
        """See `Codec.of`."""
        return cls(message)

    def encode(self, message: JointMessage) -> PackedMessage:
        """See `Codec.encode`."""
        fields = [getattr(message, name) for name in self._fields]
        if self._open:
            fields.append(None if message.values is None else message.values.ravel())
        counts = [0 if values is None else len(values) for values in fields]
        layout = (message.names, counts, message.interfaces, message.component)
        if layout != self._layout:
            self._lay_out(*layout)
        for array, values in zip(self._arrays, fields, strict=True):
            if values is not None:
                array[:] = values
        self._frame.stamp(message.stamp)
        return self._frame

    def _lay_out(self, names: tuple[str, ...], counts: list[int], interfaces: tuple[str, ...], component: str) -> None:
        """Make the buffer for these names, lengths of the arrays, further interfaces, and name of a component."""
        body = _pack_names(names)
        offsets = []
        for index, count in enumerate(counts):
            if index == len(self._fields):
                body += _pack_names(interfaces)
            body += MESSAGE_LENGTH.pack(count)
            offsets.append(len(body))
            body += bytes(8 * count)
        if self._open:
            body += _pack_text(component)
        self._frame = PackedMessage(body)
        self._layout = (names, counts, interfaces, component)
        self._arrays = [self._frame.numbers(offset, count) for offset, count in zip(offsets, counts, strict=True)]

    def decode(self, packed: bytes, sender: str) -> JointMessage:
        """See `Codec.decode`."""
        try:
            stamp, offset = _unpack_header(packed)
            layout = self._layouts.get((len(packed), offset))
            rows = None if layout is None else layout.read(packed)
            if layout is None or rows is None:
                return self._decode_all(packed, offset, stamp, sender=sender)
            message = JointMessage(layout.names, stamp=stamp, sender=sender, component=layout.component)
            message.lay(layout.rows, rows)
            return message
        except (struct.error, ValueError) as error:
            raise PipeError(
                f"{len(packed)} bytes are not a whole {self.ros_class._type}",
                expected="a message as its publisher packed it",
            ) from error

    def _decode_all(self, packed: bytes, start: int, stamp: float, sender: str) -> JointMessage:
        """Decode what follows the header, part by part, and remember how it lies."""
        self._decoded, offset = _unpack_names(packed, start, self._decoded)
        names = self._decoded[0]
        message = JointMessage(names, stamp=stamp, sender=sender)
        places = {}
        for name in self._fields:
            values, offset = _unpack_array(packed, offset)
            if len(values) not in (0, len(names)):
                raise PipeError(
                    f"{len(values)} numbers in '{name}' for {len(names)} names", expected="none, or one a name"
                )
            if len(values):
                setattr(message, name, values)
                places[name] = offset - values.nbytes
        if self._open:
            self._interfaces, offset = _unpack_names(packed, offset, self._interfaces)
            values, offset = _unpack_array(packed, offset)
            self._add_interfaces(message, values)
            offset = self._unpack_component(packed, offset, message)
        if offset != len(packed):
            raise ValueError(offset)
        self._remember(len(packed), start, JointLayout.of(packed, start, message, places=places))
        return message

    def _remember(self, length: int, start: int, layout: JointLayout | None) -> None:
        if layout is not None:
            if len(self._layouts) == 4:  # several: publishers of a topic may have different joints
                self._layouts.clear()
            self._layouts[length, start] = layout

    def _add_interfaces(self, message: JointMessage, values: np.ndarray) -> None:
        """Add the numbers of the further interfaces to a message."""
        interfaces = self._interfaces[0]
        if len(values) != len(interfaces) * len(message.names):
            raise PipeError(
                f"{len(values)} numbers in 'value' for {len(interfaces)} interfaces of {len(message.names)} names",
                expected="one for each interface and name",
            )
        if interfaces:
            message.interfaces, message.values = interfaces, values.reshape(len(interfaces), -1)

    def _unpack_component(self, packed: bytes, offset: int, message: JointMessage) -> int:
        """Unpack the name of the component, the last part of a message; return the offset behind it."""
        if not packed.startswith(self._component[1], offset):
            (length,) = MESSAGE_LENGTH.unpack_from(packed, offset)
            text = packed[offset + MESSAGE_LENGTH.size :]
            if len(text) != length:
                raise ValueError(offset)
            self._component = text.decode(), packed[offset:]
        message.component = self._component[0]
        return offset + len(self._component[1])


def _pack_text(text: str) -> bytes:
    encoded = text.encode()
    return MESSAGE_LENGTH.pack(len(encoded)) + encoded


def _pack_names(names: tuple[str, ...]) -> bytes:
    return MESSAGE_LENGTH.pack(len(names)) + b"".join(map(_pack_text, names))


def _unpack_names(
    packed: bytes, offset: int, known: tuple[tuple[str, ...], bytes]
) -> tuple[tuple[tuple[str, ...], bytes], int]:
    """Unpack names with their bytes, which are `known` if they are those of the last message; and what is behind."""
    if packed.startswith(known[1], offset):
        return known, offset + len(known[1])
    (count,) = MESSAGE_LENGTH.unpack_from(packed, offset)
    start = offset
    offset = offset + MESSAGE_LENGTH.size
    found = []
    for _ in range(count):
        (length,) = MESSAGE_LENGTH.unpack_from(packed, offset)
        offset += MESSAGE_LENGTH.size + length
        found.append(packed[offset - length : offset].decode())
    return (tuple(found), packed[start:offset]), offset


def _unpack_header(packed: bytes) -> tuple[float, int]:
    """Unpack the stamp [s] and the offset of what follows the header."""
    _, seconds, nanoseconds, length = MESSAGE_HEADER.unpack_from(packed)
    return seconds + 1e-9 * nanoseconds, MESSAGE_HEADER.size + length


def _unpack_array(packed: bytes, offset: int) -> tuple[np.ndarray, int]:
    (count,) = MESSAGE_LENGTH.unpack_from(packed, offset)
    offset += MESSAGE_LENGTH.size
    if not count:
        return NO_VALUES, offset
    return np.frombuffer(packed, "<f8", count, offset).copy(), offset + 8 * count
