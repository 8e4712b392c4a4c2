"""ROS messages of rigid bodies to named numbers and back: poses and twists, inertial measurements, wrenches."""

import math

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from solfer.errors import PipeError
from solfer.middleware.ros.codec import Codec, packed_class
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.pipes.messages import BodyMessage, ImuMessage, WrenchMessage

UNIT_TOLERANCE = 1e-3
"""How far the norm of a quaternion may be from one."""

UNKNOWN = -1.0
"""First number of the covariance of a quantity that an inertial measurement unit does not tell."""

COVARIANCES = ("orientation_covariance", "angular_velocity_covariance", "linear_acceleration_covariance")


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
        odometry = _unpack(Odometry, packed)
        pose, twist = odometry.pose.pose, odometry.twist.twist
        orientation = _orientation(pose.orientation)
        rotation = rotation_from_quaternion(orientation)
        return BodyMessage(
            odometry.header.frame_id,
            odometry.child_frame_id,
            _get(pose.position),
            orientation,
            rotation @ _get(twist.linear),
            rotation @ _get(twist.angular),
            odometry.header.stamp.to_sec(),
            sender,
        )


class ImuCodec(Codec):
    """sensor_msgs/Imu: orientation of the sensor, angular velocity and specific force in its axes.

    Covariances are diagonal with equal entries; they say how one sample scatters. All zeros: nothing is known.
    """

    def __init__(self) -> None:
        self.ros_class = packed_class(Imu)
        self._out = Imu()

    def encode(self, message: ImuMessage) -> genpy.Message:
        """See `Codec.encode`."""
        out = self._out
        out.header.stamp = rospy.Time.now()
        out.header.frame_id = message.frame
        _set(out.orientation, message.orientation)
        _set(out.angular_velocity, message.angular)
        _set(out.linear_acceleration, message.acceleration)
        for name, deviation in zip(COVARIANCES, message.deviations, strict=True):
            variance = deviation * deviation
            setattr(out, name, (variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance))
        return out

    def decode(self, packed: bytes, sender: str) -> ImuMessage:
        """See `Codec.decode`.

        Raises:
            PipeError: A quantity is marked as one that the sensor does not tell.
        """
        imu = _unpack(Imu, packed)
        covariances = [getattr(imu, name) for name in COVARIANCES]
        for name, covariance in zip(COVARIANCES, covariances, strict=True):
            if covariance[0] == UNKNOWN:
                raise PipeError(f"the sensor does not tell what '{name}' belongs to", expected="all three quantities")
        deviations = tuple(math.sqrt(max(0.0, sum(covariance[::4]) / 3.0)) for covariance in covariances)
        return ImuMessage(
            imu.header.frame_id,
            _orientation(imu.orientation),
            _get(imu.angular_velocity),
            _get(imu.linear_acceleration),
            deviations,
            imu.header.stamp.to_sec(),
            sender,
        )


class WrenchCodec(Codec):
    """geometry_msgs/WrenchStamped: force and torque in the axes of the frame."""

    def __init__(self) -> None:
        self.ros_class = packed_class(WrenchStamped)
        self._out = WrenchStamped()

    def encode(self, message: WrenchMessage) -> genpy.Message:
        """See `Codec.encode`."""
        out = self._out
        out.header.stamp = rospy.Time.now()
        out.header.frame_id = message.frame
        _set(out.wrench.force, message.force)
        _set(out.wrench.torque, message.torque)
        return out

    def decode(self, packed: bytes, sender: str) -> WrenchMessage:
        """See `Codec.decode`."""
        stamped = _unpack(WrenchStamped, packed)
        header, wrench = stamped.header, stamped.wrench
        return WrenchMessage(header.frame_id, _get(wrench.force), _get(wrench.torque), header.stamp.to_sec(), sender)


def _unpack(ros_class: type, packed: bytes) -> genpy.Message:
    try:
        return ros_class().deserialize(packed)
    except (genpy.DeserializationError, UnicodeError) as error:
        raise PipeError(f"{len(packed)} bytes are no whole {ros_class._type}") from error


def _orientation(element: genpy.Message) -> np.ndarray:
    """A unit quaternion (x, y, z, w), shape (4,)."""
    orientation = _get(element)
    norm = float(np.linalg.norm(orientation))
    if not abs(norm - 1.0) <= UNIT_TOLERANCE:
        raise PipeError(f"an orientation with norm {norm:.6g}", expected="a unit quaternion")
    return orientation / norm


def _get(element: genpy.Message) -> np.ndarray:
    return np.array([getattr(element, name) for name in element.__slots__])


def _set(element: genpy.Message, values: np.ndarray) -> None:
    for name, value in zip(element.__slots__, values.tolist(), strict=True):
        setattr(element, name, value)
