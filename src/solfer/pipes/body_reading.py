"""What messages tell about a rigid body, brought from the sender's conventions into ours."""

import abc
import math
from typing import ClassVar

import numpy as np

from solfer.config.conventions import AnglesRecord, ConventionRecord
from solfer.errors import NotFinite, PipeError, nearest
from solfer.numerics.rotations import (
    QuaternionConvention,
    require_unit,
    rotation_from_angles,
    rotation_from_quaternion,
)
from solfer.pipes.messages import BodyMessage, ImuMessage, Message, VectorMessage

MOVING = (0, 1, 2)
"""Turns of the chart of a floating base: about x, then y, then z."""


class BodyReading(abc.ABC):
    """Reads one type of message.

    Args:
        body: The sender's name of the body.
        convention: How the sender writes orientation and twist.
        axes: Order of the turns, of an orientation that is three angles.

    Attributes:
        carries: What the message tells: position, orientation, linear and angular velocity.
        position: Position of the body in the world, shape (3,) [m].
        rotation: Rotation from the body to the world, shape (3, 3).
        linear: Velocity of the body, shape (3,) [m/s]: in the axes of the world, or of the body if `in_body_axes`.
        angular: Angular velocity of the body, shape (3,) [rad/s], in the same axes.
        in_body_axes: Whether the twist could not be turned because the message tells no orientation.
    """

    carries: ClassVar[frozenset[str]]

    def __init__(self, body: str, convention: ConventionRecord, axes: tuple[int, int, int] = MOVING):
        self._body, self._axes, self._twist_frame = body, axes, convention.twist.frame
        orientation = convention.orientation
        self._convention = QuaternionConvention(orientation.order, orientation.convention)
        self._as_prescribed = orientation.order == "xyzw" and orientation.convention == "HAMILTONIAN"
        self._quaternion = np.array((0.0, 0.0, 0.0, 1.0))
        self._numbers = np.zeros(9)
        self.position, self.linear, self.angular = self._numbers[:3], self._numbers[3:6], self._numbers[6:]
        self.rotation, self.in_body_axes = np.eye(3), False

    def read(self, message: Message) -> None:
        """Take the numbers of a message.

        Raises:
            PipeError: The message is about another body, or its orientation is none.
            NotFinite: A number is not finite.
        """
        self._take(message)
        if not math.isfinite(self._numbers.sum()):  # each is, if their sum is
            raise NotFinite("a position or a velocity that is not a finite number")

    @abc.abstractmethod
    def _take(self, message: Message) -> None:
        """Take the numbers; those that are not in the orientation need no check."""

    def _check_name(self, name: str) -> None:
        if name != self._body:
            raise PipeError(f"it is about '{name}'", expected=f"'{self._body}', or the key 'reference' in the pipe",
                            names=nearest(name, (self._body,)))

    def _orient(self, quaternion: np.ndarray) -> None:
        require_unit(quaternion)
        if not self._as_prescribed:
            quaternion = self._convention.read(quaternion, self._quaternion)
        self.rotation = rotation_from_quaternion(quaternion.tolist())

    def _turn_twist(self, linear: np.ndarray, angular: np.ndarray, turned: bool) -> None:
        """Take a twist; `turned` says that it has to be turned from the body's axes to those of the world."""
        if turned:
            np.matmul(self.rotation, linear, out=self.linear)
            np.matmul(self.rotation, angular, out=self.angular)
        else:
            self.linear[:], self.angular[:] = linear, angular


class OdometryReading(BodyReading):
    """nav_msgs/Odometry; it prescribes a twist in the axes of the body."""

    carries = frozenset(("position", "orientation", "linear", "angular"))

    def _take(self, message: BodyMessage) -> None:
        self._check_name(message.child)
        self._orient(message.orientation)
        self.position[:] = message.position
        if self._as_prescribed and self._twist_frame != "world":
            self._turn_twist(message.linear, message.angular, False)
        else:  # back to the numbers of the sender, who does not do as the message prescribes
            prescribed = rotation_from_quaternion(message.orientation)
            linear, angular = message.linear @ prescribed, message.angular @ prescribed
            self._turn_twist(linear, angular, self._twist_frame != "world")


class ImuReading(BodyReading):
    """sensor_msgs/Imu; it prescribes an angular velocity in the axes of the sensor."""

    carries = frozenset(("orientation", "angular"))

    def _take(self, message: ImuMessage) -> None:
        self._check_name(message.frame)
        self._orient(message.orientation)
        self._turn_twist(self.linear, message.angular, self._twist_frame != "world")


class PoseReading(BodyReading):
    """geometry_msgs/PoseStamped."""

    carries = frozenset(("position", "orientation"))

    def _take(self, message: VectorMessage) -> None:
        self._orient(message.values[3:])
        self.position[:] = message.values[:3]


class QuaternionReading(BodyReading):
    """geometry_msgs/QuaternionStamped."""

    carries = frozenset(("orientation",))

    def _take(self, message: VectorMessage) -> None:
        self._orient(message.values)


class AnglesReading(BodyReading):
    """geometry_msgs/Vector3Stamped: angles about x, y and z."""

    carries = frozenset(("orientation",))

    def _take(self, message: VectorMessage) -> None:
        if not np.isfinite(message.values).all():
            raise NotFinite("an angle that is not a finite number")
        self.rotation = rotation_from_angles(message.values.tolist(), self._axes)


class TwistReading(BodyReading):
    """geometry_msgs/TwistStamped; the frame of its header says whose axes are meant."""

    carries = frozenset(("linear", "angular"))

    def _take(self, message: VectorMessage) -> None:
        frame = self._twist_frame or ("body" if message.frame == self._body else "world")
        self.in_body_axes = frame == "body"
        self._turn_twist(message.values[:3], message.values[3:], False)


READINGS: dict[str, type[BodyReading]] = {
    "nav_msgs/Odometry": OdometryReading,
    "sensor_msgs/Imu": ImuReading,
    "geometry_msgs/PoseStamped": PoseReading,
    "geometry_msgs/QuaternionStamped": QuaternionReading,
    "geometry_msgs/Vector3Stamped": AnglesReading,
    "geometry_msgs/TwistStamped": TwistReading,
}
"""Messages of a rigid body by their canonical name, and what reads them."""


def turns(record: AnglesRecord | None) -> tuple[int, int, int]:
    """The order of the turns that a pipe asks for."""
    return MOVING if record is None else record.axes()
