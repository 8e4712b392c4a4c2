"""ROS messages of geometry to numbers and back: points, vectors, orientations, poses and twists with a header."""

import struct

import numpy as np

from solfer.errors import PipeError
from solfer.middleware.ros.codec import Codec, packed_class
from solfer.middleware.ros.codecs_body import Numbers
from solfer.middleware.ros.frame import HEADER, Frame
from solfer.middleware.ros.interfaces import message_class
from solfer.pipes.messages import VECTOR_MESSAGES, VectorMessage


class VectorCodec(Codec):
    """A header and a fixed count of numbers.

    Args:
        message: Canonical name of the message, one of VECTOR_MESSAGES.
    """

    def __init__(self, message: str):
        self.ros_class = packed_class(message_class(message))
        self._count = VECTOR_MESSAGES[message]
        self._out = Numbers(self._count)

    def encode(self, message: VectorMessage) -> Frame:
        """See `Codec.encode`."""
        self._out.of(message.frame)[:] = message.values
        return self._out.stamped()

    def decode(self, packed: bytes, sender: str) -> VectorMessage:
        """See `Codec.decode`."""
        try:
            _, seconds, nanoseconds, length = HEADER.unpack_from(packed)
            begin = HEADER.size + length
            frame = packed[HEADER.size : begin].decode()
            if len(packed) != begin + 8 * self._count:
                raise ValueError(begin)
        except (struct.error, ValueError) as error:
            raise PipeError(f"{len(packed)} bytes are no whole {self.ros_class._type}") from error
        values = np.frombuffer(packed, "<f8", self._count, begin).copy()
        return VectorMessage(frame, values, seconds + 1e-9 * nanoseconds, sender)
