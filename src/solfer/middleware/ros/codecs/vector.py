"""ROS messages of geometry to numbers and back: points, vectors, orientations, poses, twists, and several of them."""

import io
import struct

import numpy as np

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.base import Codec, packed_class, unpack
from solfer.middleware.ros.codecs.body import NumbersBuffer
from solfer.middleware.ros.codecs.interfaces import message_class
from solfer.middleware.ros.codecs.packed_message import MESSAGE_HEADER, PackedMessage
from solfer.transport.messages import ROBOT_POINTS, VECTOR_MESSAGES, PointsMessage, VectorMessage


class VectorCodec(Codec):
    """A header and a fixed count of numbers.

    Args:
        message: Canonical name of the message, one of VECTOR_MESSAGES.
    """

    messages = VECTOR_MESSAGES

    def __init__(self, message: str):
        self.ros_class = packed_class(message_class(message))
        self._count = VECTOR_MESSAGES[message]
        self._out = NumbersBuffer(self._count)

    @classmethod
    def of(cls, message: str) -> "VectorCodec":
        """See `Codec.of`."""
        return cls(message)

    def encode(self, message: VectorMessage) -> PackedMessage:
        """See `Codec.encode`."""
        self._out.view(message.frame)[:] = message.values
        return self._out.stamped(message.stamp)

    def decode(self, packed: bytes, sender: str) -> VectorMessage:
        """See `Codec.decode`."""
        try:
            _, seconds, nanoseconds, length = MESSAGE_HEADER.unpack_from(packed)
            begin = MESSAGE_HEADER.size + length
            frame = packed[MESSAGE_HEADER.size : begin].decode()
            if len(packed) != begin + 8 * self._count:
                raise ValueError(begin)
        except (struct.error, ValueError) as error:
            raise PipeError(
                f"{len(packed)} bytes are not a whole {self.ros_class._type}",
                expected="a message as its publisher packed it",
            ) from error
        values = np.frombuffer(packed, "<f8", self._count, begin).copy()
        return VectorMessage(frame, values, seconds + 1e-9 * nanoseconds, sender=sender)


class PointsCodec(Codec):
    """solfer/RobotPoints: several Robot Points of one kind."""

    messages = (ROBOT_POINTS,)

    def __init__(self) -> None:
        self._type = message_class(ROBOT_POINTS)
        self.ros_class = packed_class(self._type)

    def encode(self, message: PointsMessage) -> PackedMessage:
        """See `Codec.encode`; the packed message is a new one each time."""
        count = len(message.values)
        values = message.values.ravel().tolist()
        buffer = io.BytesIO()
        self._type(name=message.names, count=count, value=values).serialize(buffer)
        frame = PackedMessage(buffer.getvalue()[MESSAGE_HEADER.size :], message.frame)
        frame.stamp()
        return frame

    def decode(self, packed: bytes, sender: str) -> PointsMessage:
        """See `Codec.decode`.

        Raises:
            PipeError: There is not one name, or not the same count of numbers, for each Point.
        """
        published = unpack(self._type, packed)
        if (
            published.count == 0
            or len(published.value) % published.count
            or len(published.name) not in (0, published.count)
        ):
            raise PipeError(
                f"{len(published.value)} numbers and {len(published.name)} names for {published.count} Points",
                expected="as many numbers for each, and a name for each or none",
            )
        values = np.array(published.value).reshape(published.count, -1)
        return PointsMessage(
            published.header.frame_id,
            tuple(published.name),
            values,
            stamp=published.header.stamp.to_sec(),
            sender=sender,
        )
