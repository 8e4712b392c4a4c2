"""ROS messages to named numbers and back.

Messages stay packed until somebody reads them: rospy's receiving thread only keeps the bytes, and the loop decodes
the newest of them. The names of a joint-space message hardly ever change, so their bytes are compared with those of the
last message instead of being decoded again.
"""

import abc
import functools
import struct

import genpy
import numpy as np
import rospy
from nav_msgs.msg import Odometry

from solfer.errors import PipeError
from solfer.middleware.ros.interfaces import message_class
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.pipes.messages import JOINT_MESSAGES, BodyMessage, JointMessage, Message

LENGTH = struct.Struct("<I")
HEADER = struct.Struct("<IIII")
"""Sequence number, seconds, nanoseconds, and length of the frame's name that follows."""

NOTHING = np.zeros(0)

UNIT_TOLERANCE = 1e-3
"""How far the norm of a quaternion may be from one."""


class Codec(abc.ABC):
    """Translates one type of message.

    Attributes:
        ros_class: Class to publish and to subscribe with: the type of the message, but it keeps its bytes in `packed`.
    """

    ros_class: type

    @abc.abstractmethod
    def encode(self, message: Message) -> genpy.Message:
        """A message for rospy, stamped with the present ROS time; it is the same object each time."""

    @abc.abstractmethod
    def decode(self, packed: bytes, sender: str) -> Message:
        """The numbers in the bytes of a message.

        Raises:
            PipeError: The bytes contradict the type, or themselves.
        """


def codec(message: str) -> Codec:
    """The codec of a message by its canonical name."""
    return JointCodec(message) if message in JOINT_MESSAGES else BodyCodec()


@functools.cache
def packed_class(ros_class: type) -> type:
    """A class that looks like `ros_class` to rospy; what is behind the header stays packed."""

    class Packed(ros_class):
        def serialize(self, buff):
            self.header.serialize(buff)
            buff.write(self.packed)

        def deserialize(self, data):
            self.packed = data
            return self

    Packed.__name__ = ros_class.__name__
    return Packed


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


class BodyCodec(Codec):
    """nav_msgs/Odometry: the pose in the frame of reference, the twist in the axes of the child frame."""

    def __init__(self) -> None:
        self.ros_class = packed_class(Odometry)
        self._out = Odometry()

    def encode(self, message: BodyMessage) -> genpy.Message:
        """See `Codec.encode`."""
        out, rotation = self._out, rotation_from_quaternion(message.orientation)
        out.header.stamp = rospy.Time.now()
        out.header.frame_id, out.child_frame_id = message.frame, message.child
        _set(out.pose.pose.position, message.position)
        _set(out.pose.pose.orientation, message.orientation)
        _set(out.twist.twist.linear, message.linear @ rotation)
        _set(out.twist.twist.angular, message.angular @ rotation)
        return out

    def decode(self, packed: bytes, sender: str) -> BodyMessage:
        """See `Codec.decode`."""
        try:
            odometry = Odometry().deserialize(packed)
        except (genpy.DeserializationError, UnicodeError) as error:
            raise PipeError(f"{len(packed)} bytes are no whole nav_msgs/Odometry") from error
        pose, twist = odometry.pose.pose, odometry.twist.twist
        orientation = _get(pose.orientation)
        norm = float(np.linalg.norm(orientation))
        if not abs(norm - 1.0) <= UNIT_TOLERANCE:
            raise PipeError(f"an orientation with norm {norm:.6g}", expected="a unit quaternion")
        rotation = rotation_from_quaternion(orientation)
        return BodyMessage(
            odometry.header.frame_id,
            odometry.child_frame_id,
            _get(pose.position),
            orientation / norm,
            rotation @ _get(twist.linear),
            rotation @ _get(twist.angular),
            odometry.header.stamp.to_sec(),
            sender,
        )


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


def _get(element: genpy.Message) -> np.ndarray:
    return np.array([getattr(element, name) for name in element.__slots__])


def _set(element: genpy.Message, values: np.ndarray) -> None:
    for name, value in zip(element.__slots__, values.tolist(), strict=True):
        setattr(element, name, value)
