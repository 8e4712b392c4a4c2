"""Joint-space messages to named numbers and back.

The names of a joint-space message hardly ever change, so their bytes are compared with those of the last message
instead of being decoded again.
"""

import struct

import genpy
import numpy as np
import rospy

from solfer.errors import PipeError
from solfer.middleware.ros.codec import Codec, packed_class
from solfer.middleware.ros.interfaces import message_class
from solfer.pipes.messages import JOINT_MESSAGES, JointMessage

LENGTH = struct.Struct("<I")
HEADER = struct.Struct("<IIII")
"""Sequence number, seconds, nanoseconds, and length of the frame's name that follows."""

NOTHING = np.zeros(0)


class JointCodec(Codec):
    """sensor_msgs/JointState and solfer/JointCommand: a header, names, and arrays, empty or as long as the names.

    Args:
        message: Canonical name of the message.
    """

    def __init__(self, message: str):
        self._fields = JOINT_MESSAGES[message]
        self.ros_class = packed_class(message_class(message))
        self._out = self.ros_class()
        self._encoded: tuple[tuple[str, ...], bytes] = ((), _pack_names(()))
        self._decoded: tuple[tuple[str, ...], bytes] = self._encoded

    def encode(self, message: JointMessage) -> genpy.Message:
        """See `Codec.encode`."""
        if message.names != self._encoded[0]:
            self._encoded = (message.names, _pack_names(message.names))
        parts = [self._encoded[1]]
        for name in self._fields:
            values = getattr(message, name)
            if values is None:
                parts.append(LENGTH.pack(0))
            else:
                parts += (LENGTH.pack(len(values)), np.asarray(values, dtype="<f8").tobytes())
        self._out.packed = b"".join(parts)
        self._out.header.stamp = rospy.Time.now()
        return self._out

    def decode(self, packed: bytes, sender: str) -> JointMessage:
        """See `Codec.decode`."""
        try:
            stamp, offset = _unpack_header(packed)
            names, offset = self._unpack_names(packed, offset)
            message = JointMessage(names, stamp=stamp, sender=sender)
            for name in self._fields:
                values, offset = _unpack_array(packed, offset)
                if len(values) not in (0, len(names)):
                    raise PipeError(
                        f"{len(values)} numbers in '{name}' for {len(names)} names", expected="none, or one a name"
                    )
                if len(values):
                    setattr(message, name, values)
            if offset != len(packed):
                raise ValueError(offset)
        except (struct.error, ValueError) as error:
            raise PipeError(f"{len(packed)} bytes are no whole {self.ros_class._type}") from error
        return message

    def _unpack_names(self, packed: bytes, offset: int) -> tuple[tuple[str, ...], int]:
        names, known = self._decoded
        if packed.startswith(known, offset):
            return names, offset + len(known)
        (count,) = LENGTH.unpack_from(packed, offset)
        start, offset = offset, offset + LENGTH.size
        found = []
        for _ in range(count):
            (length,) = LENGTH.unpack_from(packed, offset)
            offset += LENGTH.size + length
            found.append(packed[offset - length : offset].decode())
        self._decoded = (tuple(found), packed[start:offset])
        return self._decoded[0], offset


def _pack_names(names: tuple[str, ...]) -> bytes:
    encoded = [name.encode() for name in names]
    return LENGTH.pack(len(encoded)) + b"".join(LENGTH.pack(len(name)) + name for name in encoded)


def _unpack_header(packed: bytes) -> tuple[float, int]:
    """Stamp [s] and the offset of what follows the header."""
    _, seconds, nanoseconds, length = HEADER.unpack_from(packed)
    return seconds + 1e-9 * nanoseconds, HEADER.size + length


def _unpack_array(packed: bytes, offset: int) -> tuple[np.ndarray, int]:
    (count,) = LENGTH.unpack_from(packed, offset)
    offset += LENGTH.size
    if not count:
        return NOTHING, offset
    return np.frombuffer(packed, "<f8", count, offset).copy(), offset + 8 * count
