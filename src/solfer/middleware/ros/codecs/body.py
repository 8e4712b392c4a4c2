"""ROS messages of rigid bodies to named numbers and back: poses and twists, inertial measurements, wrenches."""

import math
from typing import Any

import genpy
import numpy as np
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from solfer.middleware.ros.codecs.base import Codec, packed_class, unpack
from solfer.middleware.ros.codecs.packed_message import MESSAGE_LENGTH, PackedMessage
from solfer.numerics.rotations import normalize, rotation_from_quaternion
from solfer.transport.inexact import InexactOrientations
from solfer.transport.messages import (
    BODY_MESSAGES,
    IMU_MESSAGES,
    WRENCH_MESSAGES,
    BodyMessage,
    ImuMessage,
    WrenchMessage,
)

NOT_MEASURED = -1.0
"""First number of the covariance of a quantity that an inertial measurement unit does not measure."""


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
        self._out = NumbersBuffer(85)  # pose and its covariance, twist and its covariance

    def encode(self, message: BodyMessage) -> PackedMessage:
        """See `Codec.encode`."""
        numbers = self._out.view(message.frame, message.child)
        rotation = rotation_from_quaternion(message.orientation)
        numbers[0:3] = message.position
        numbers[3:7] = message.orientation
        numbers[7:43] = message.pose_covariance.ravel()
        numbers[43:46] = message.linear @ rotation
        numbers[46:49] = message.angular @ rotation
        numbers[49:85] = message.twist_covariance.ravel()
        return self._out.stamped(message.stamp)

    def decode(self, packed: bytes, sender: str) -> BodyMessage:
        """See `Codec.decode`."""
        odometry = unpack(Odometry, packed)
        pose = odometry.pose.pose
        twist = odometry.twist.twist
        orientation = _orientation(pose.orientation, self._inexact, sender)
        rotation = rotation_from_quaternion(orientation)
        return BodyMessage(
            odometry.header.frame_id,
            odometry.child_frame_id,
            _get(pose.position),
            orientation=orientation,
            linear=rotation @ _get(twist.linear),
            angular=rotation @ _get(twist.angular),
            stamp=odometry.header.stamp.to_sec(),
            sender=sender,
            pose_covariance=np.reshape(odometry.pose.covariance, (6, 6)),
            twist_covariance=np.reshape(odometry.twist.covariance, (6, 6)),
        )


class ImuCodec(Codec):
    """sensor_msgs/Imu: orientation of the sensor, angular velocity and specific force in its axes.

    Covariances are diagonal with equal entries, those of one sample. All zeros: nothing is known. A first entry of
    NOT_MEASURED: the sensor does not measure the quantity, whose numbers are NaN then.
    """

    messages = IMU_MESSAGES

    def __init__(self) -> None:
        self.ros_class = packed_class(Imu)
        self._inexact = InexactOrientations()
        self._out = NumbersBuffer(37)  # each quantity with its covariance, row by row

    def encode(self, message: ImuMessage) -> PackedMessage:
        """See `Codec.encode`."""
        numbers = self._out.view(message.frame)
        numbers[0:4] = message.orientation
        numbers[13:16] = message.angular
        numbers[25:28] = message.acceleration
        for begin, deviation in zip((4, 16, 28), message.deviations, strict=True):
            numbers[begin : begin + 9 : 4] = deviation * deviation
        for begin, end in ((0, 4), (13, 16), (25, 28)):
            if np.isnan(numbers[begin:end]).all():
                numbers[begin:end] = 0.0
                numbers[end] = NOT_MEASURED
        return self._out.stamped(message.stamp)

    def decode(self, packed: bytes, sender: str) -> ImuMessage:
        """See `Codec.decode`."""
        imu = unpack(Imu, packed)
        covariances = (imu.orientation_covariance, imu.angular_velocity_covariance, imu.linear_acceleration_covariance)
        lacks_orientation, lacks_angular, lacks_force = (covariance[0] == NOT_MEASURED for covariance in covariances)
        lacks_orientation = lacks_orientation or not any(_get(imu.orientation))
        deviations: Any = tuple(math.sqrt(max(0.0, sum(covariance[::4]) / 3.0)) for covariance in covariances)
        return ImuMessage(
            imu.header.frame_id,
            np.full(4, np.nan) if lacks_orientation else _orientation(imu.orientation, self._inexact, sender),
            np.full(3, np.nan) if lacks_angular else _get(imu.angular_velocity),
            acceleration=np.full(3, np.nan) if lacks_force else _get(imu.linear_acceleration),
            deviations=deviations,
            stamp=imu.header.stamp.to_sec(),
            sender=sender,
        )


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


def _orientation(element: genpy.Message, inexact: InexactOrientations, sender: str) -> np.ndarray:
    """Read a unit quaternion (x, y, z, w) of a sender, shape (4,); report an inexact one."""
    orientation = _get(element)
    if normalize(orientation):
        inexact.report(sender)
    return orientation


def _get(element: genpy.Message) -> np.ndarray:
    return np.array([getattr(element, name) for name in element.__slots__])
