"""Joint-space messages to named numbers and back.

The names of a joint-space message hardly ever change, so their bytes are compared with those of the last message
instead of being decoded again.
"""

import struct

import numpy as np
import rospy

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.base import Codec, packed_class
from solfer.middleware.ros.codecs.interfaces import message_class
from solfer.middleware.ros.codecs.packed_message import HEADER, LENGTH, PackedMessage
from solfer.transport.messages import ANY_INTERFACE, JOINT_MESSAGES, JointMessage

NOTHING = np.zeros(0)


class JointCodec(Codec):
    """sensor_msgs/JointState and solfer/JointCommand: a header, names, and arrays, empty or as long as the names.

    The latter has further interfaces behind them: their names, and one array for all.

    Args:
        message: Canonical name of the message.
    """

    def __init__(self, message: str):
        self._fields, self._open = JOINT_MESSAGES[message], message == ANY_INTERFACE
        self.ros_class = packed_class(message_class(message))
        self._layout: tuple[tuple[str, ...], list[int], tuple[str, ...]] | None = None
        self._frame = PackedMessage(b"")
        self._arrays: list[np.ndarray] = []
        self._decoded: tuple[tuple[str, ...], bytes] = ((), _pack_names(()))
        self._interfaces: tuple[tuple[str, ...], bytes] = self._decoded

    def encode(self, message: JointMessage) -> PackedMessage:
        """See `Codec.encode`."""
        fields = [getattr(message, name) for name in self._fields]
        if self._open:
            fields.append(None if message.values is None else message.values.ravel())
        layout = (message.names, [0 if values is None else len(values) for values in fields], message.interfaces)
        if layout != self._layout:
            self._lay_out(*layout)
        for array, values in zip(self._arrays, fields, strict=True):
            if values is not None:
                array[:] = values
        self._frame.stamp(rospy.Time.now())
        return self._frame

    def _lay_out(self, names: tuple[str, ...], counts: list[int], interfaces: tuple[str, ...]) -> None:
        """Make the buffer for these names, lengths of the arrays, and further interfaces."""
        body, offsets = _pack_names(names), []
        for index, count in enumerate(counts):
            if index == len(self._fields):
                body += _pack_names(interfaces)
            body += LENGTH.pack(count)
            offsets.append(len(body))
            body += bytes(8 * count)
        self._frame, self._layout = PackedMessage(body), (names, counts, interfaces)
        self._arrays = [self._frame.numbers(offset, count) for offset, count in zip(offsets, counts, strict=True)]

    def decode(self, packed: bytes, sender: str) -> JointMessage:
        """See `Codec.decode`."""
        try:
            stamp, offset = _unpack_header(packed)
            self._decoded, offset = _unpack_names(packed, offset, self._decoded)
            names = self._decoded[0]
            message = JointMessage(names, stamp=stamp, sender=sender)
            for name in self._fields:
                values, offset = _unpack_array(packed, offset)
                if len(values) not in (0, len(names)):
                    raise PipeError(
                        f"{len(values)} numbers in '{name}' for {len(names)} names", expected="none, or one a name"
                    )
                if len(values):
                    setattr(message, name, values)
            if self._open:
                offset = self._unpack_interfaces(packed, offset, message)
            if offset != len(packed):
                raise ValueError(offset)
        except (struct.error, ValueError) as error:
            raise PipeError(
                f"{len(packed)} bytes are not a whole {self.ros_class._type}",
                expected="a message as its publisher packed it",
            ) from error
        return message

    def _unpack_interfaces(self, packed: bytes, offset: int, message: JointMessage) -> int:
        """Unpack the further interfaces of a message; return the offset behind them."""
        self._interfaces, offset = _unpack_names(packed, offset, self._interfaces)
        interfaces = self._interfaces[0]
        values, offset = _unpack_array(packed, offset)
        if len(values) != len(interfaces) * len(message.names):
            raise PipeError(
                f"{len(values)} numbers in 'value' for {len(interfaces)} interfaces of {len(message.names)} names",
                expected="one for each interface and name",
            )
        if interfaces:
            message.interfaces, message.values = interfaces, values.reshape(len(interfaces), -1)
        return offset


def _pack_names(names: tuple[str, ...]) -> bytes:
    encoded = [name.encode() for name in names]
    return LENGTH.pack(len(encoded)) + b"".join(LENGTH.pack(len(name)) + name for name in encoded)


def _unpack_names(
    packed: bytes, offset: int, known: tuple[tuple[str, ...], bytes]
) -> tuple[tuple[tuple[str, ...], bytes], int]:
    """Unpack names with their bytes, which are `known` if they are those of the last message; and what is behind."""
    if packed.startswith(known[1], offset):
        return known, offset + len(known[1])
    (count,) = LENGTH.unpack_from(packed, offset)
    start, offset = offset, offset + LENGTH.size
    found = []
    for _ in range(count):
        (length,) = LENGTH.unpack_from(packed, offset)
        offset += LENGTH.size + length
        found.append(packed[offset - length : offset].decode())
    return (tuple(found), packed[start:offset]), offset


def _unpack_header(packed: bytes) -> tuple[float, int]:
    """Unpack the stamp [s] and the offset of what follows the header."""
    _, seconds, nanoseconds, length = HEADER.unpack_from(packed)
    return seconds + 1e-9 * nanoseconds, HEADER.size + length


def _unpack_array(packed: bytes, offset: int) -> tuple[np.ndarray, int]:
    (count,) = LENGTH.unpack_from(packed, offset)
    offset += LENGTH.size
    if not count:
        return NOTHING, offset
    return np.frombuffer(packed, "<f8", count, offset).copy(), offset + 8 * count
