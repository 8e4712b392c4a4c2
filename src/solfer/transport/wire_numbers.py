"""Numbers of rigid bodies in the order in which messages of ROS have them, and back: the same in ROS 1 and ROS 2."""

import math
from typing import Any

import numpy as np

from solfer.numerics.rotations import normalize, rotation_from_quaternion
from solfer.transport.inexact import InexactOrientations
from solfer.transport.messages import BodyMessage, ImuMessage

BODY_NUMBERS = 85
"""nav_msgs/Odometry: pose and its covariance, twist in the axes of the child frame and its covariance."""

IMU_NUMBERS = 37
"""sensor_msgs/Imu: each quantity with its covariance, row by row."""

NOT_MEASURED = -1.0
"""First number of the covariance of a quantity that an inertial measurement unit does not measure."""


def put_body(message: BodyMessage, numbers: np.ndarray) -> None:
    """Write a body's numbers, shape (BODY_NUMBERS,)."""
    rotation = rotation_from_quaternion(message.orientation)
    numbers[0:3] = message.position
    numbers[3:7] = message.orientation
    numbers[7:43] = message.pose_covariance.ravel()
    numbers[43:46] = message.linear @ rotation
    numbers[46:49] = message.angular @ rotation
    numbers[49:85] = message.twist_covariance.ravel()


def body_of(numbers: np.ndarray, inexact: InexactOrientations, frame: str, child: str, **origin: Any) -> BodyMessage:
    """Make the message of a body's numbers, shape (BODY_NUMBERS,).

    Args:
        numbers: The numbers; the message keeps views of them.
        inexact: Reports quaternions that are not of unit length.
        frame: Frame of reference.
        child: The link.
        **origin: Stamp [s] and sender.
    """
    orientation = _orientation(numbers[3:7], inexact, origin["sender"])
    rotation = rotation_from_quaternion(orientation)
    return BodyMessage(
        frame,
        child,
        numbers[0:3],
        orientation=orientation,
        linear=rotation @ numbers[43:46],
        angular=rotation @ numbers[46:49],
        pose_covariance=numbers[7:43].reshape(6, 6),
        twist_covariance=numbers[49:85].reshape(6, 6),
        **origin,
    )


def put_imu(message: ImuMessage, numbers: np.ndarray) -> None:
    """Write the numbers of an inertial measurement unit, shape (IMU_NUMBERS,), which were zero before the first."""
    numbers[0:4] = message.orientation
    numbers[13:16] = message.angular
    numbers[25:28] = message.acceleration
    for begin, deviation in zip((4, 16, 28), message.deviations, strict=True):
        numbers[begin : begin + 9 : 4] = deviation * deviation
    for begin, end in ((0, 4), (13, 16), (25, 28)):
        if np.isnan(numbers[begin:end]).all():
            numbers[begin:end] = 0.0
            numbers[end] = NOT_MEASURED


def imu_of(numbers: np.ndarray, inexact: InexactOrientations, frame: str, **origin: Any) -> ImuMessage:
    """Make the message of an inertial measurement unit's numbers, shape (IMU_NUMBERS,); see `body_of`."""
    lacks_orientation, lacks_angular, lacks_force = (numbers[begin] == NOT_MEASURED for begin in (4, 16, 28))
    lacks_orientation = lacks_orientation or not numbers[0:4].any()
    deviations: Any = tuple(math.sqrt(max(0.0, numbers[begin : begin + 9 : 4].sum() / 3.0)) for begin in (4, 16, 28))
    return ImuMessage(
        frame,
        np.full(4, np.nan) if lacks_orientation else _orientation(numbers[0:4], inexact, origin["sender"]),
        np.full(3, np.nan) if lacks_angular else numbers[13:16],
        acceleration=np.full(3, np.nan) if lacks_force else numbers[25:28],
        deviations=deviations,
        **origin,
    )


def _orientation(orientation: np.ndarray, inexact: InexactOrientations, sender: str) -> np.ndarray:
    """Make a quaternion (x, y, z, w) of a sender one of unit length, in place; report an inexact one."""
    if normalize(orientation):
        inexact.report(sender)
    return orientation
