"""ROS messages of rigid bodies to named numbers and back: poses and twists, inertial measurements, wrenches."""

import genpy
import numpy as np
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from solfer.middleware.ros.codecs.base import Codec, packed_class, unpack
from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH, PackedMessage
from solfer.transport.inexact import InexactOrientations
from solfer.transport.messages import (
    BODY_MESSAGES,
    IMU_MESSAGES,
    WRENCH_MESSAGES,
    BodyMessage,
    ImuMessage,
    WrenchMessage,
)
from solfer.transport.wire_numbers import BODY_NUMBERS, IMU_NUMBERS, body_of, imu_of, put_body, put_imu


class NumbersBuffer:
    """A packed message with a body of a fixed count of numbers, perhaps behind the name of a child frame.

    Args:
        count: How many numbers.
    """

    def __init__(self, count: int):
        self._count = count
        self._names: tuple[str, str | None] | None = None

    def view(self, frame: str, child: str | None = None) -> np.ndarray:
        """Return the numbers of a message with these names, a live view; zero where nothing was ever written to."""
        if (frame, child) != self._names:
            name = b"" if child is None else MESSAGE_LENGTH.pack(len(child.encode())) + child.encode()
            self._names = (frame, child)
            self._frame = PackedMessage(name + bytes(8 * self._count), frame)
            self._numbers = self._frame.numbers(len(name), self._count)
        return self._numbers

    def stamped(self, measured: float) -> PackedMessage:
        """Return the message, stamped with when it was measured; see `PackedMessage.stamp`."""
        self._frame.stamp(measured)
        return self._frame


class BodyCodec(Codec):
    """nav_msgs/Odometry: the pose in the frame of reference, the twist in the axes of the child frame."""

    messages = BODY_MESSAGES

    def __init__(self) -> None:
        self.ros_class = packed_class(Odometry)
        self._inexact = InexactOrientations()
        self._out = NumbersBuffer(BODY_NUMBERS)

    def encode(self, message: BodyMessage) -> PackedMessage:
        """See `Codec.encode`."""
        put_body(message, self._out.view(message.frame, message.child))
        return self._out.stamped(message.stamp)

    def decode(self, packed: bytes, sender: str) -> BodyMessage:
        """See `Codec.decode`."""
        odometry = unpack(Odometry, packed)
        header = odometry.header
        numbers = np.frombuffer(packed[-8 * BODY_NUMBERS :], "<f8").copy()
        return body_of(
            numbers,
            self._inexact,
            header.frame_id,
            odometry.child_frame_id,
            stamp=header.stamp.to_sec(),
            sender=sender,
        )


class ImuCodec(Codec):
    """sensor_msgs/Imu: orientation of the sensor, angular velocity and specific force in its axes.

    Covariances are diagonal with equal entries, those of one sample. All zeros: nothing is known. A first entry of
    minus one: the sensor does not measure the quantity, whose numbers are NaN then.
    """

    messages = IMU_MESSAGES

    def __init__(self) -> None:
        self.ros_class = packed_class(Imu)
        self._inexact = InexactOrientations()
        self._out = NumbersBuffer(IMU_NUMBERS)

    def encode(self, message: ImuMessage) -> PackedMessage:
        """See `Codec.encode`."""
        put_imu(message, self._out.view(message.frame))
        return self._out.stamped(message.stamp)

    def decode(self, packed: bytes, sender: str) -> ImuMessage:
        """See `Codec.decode`."""
        header = unpack(Imu, packed).header
        numbers = np.frombuffer(packed[-8 * IMU_NUMBERS :], "<f8").copy()
        return imu_of(numbers, self._inexact, header.frame_id, stamp=header.stamp.to_sec(), sender=sender)


class WrenchCodec(Codec):
    """geometry_msgs/WrenchStamped: force and torque in the axes of the frame."""

    messages = WRENCH_MESSAGES

    def __init__(self) -> None:
        self.ros_class = packed_class(WrenchStamped)
        self._out = NumbersBuffer(6)

    def encode(self, message: WrenchMessage) -> PackedMessage:
        """See `Codec.encode`."""
        numbers = self._out.view(message.frame)
        numbers[:3] = message.force
        numbers[3:] = message.torque
        return self._out.stamped(message.stamp)

    def decode(self, packed: bytes, sender: str) -> WrenchMessage:
        """See `Codec.decode`."""
        stamped = unpack(WrenchStamped, packed)
        header = stamped.header
        wrench = stamped.wrench
        return WrenchMessage(
            header.frame_id, _get(wrench.force), _get(wrench.torque), stamp=header.stamp.to_sec(), sender=sender
        )


def _get(element: genpy.Message) -> np.ndarray:
    return np.array([getattr(element, name) for name in element.__slots__])
