"""Reads messages of a rigid body, and converts them from the sender's conventions to ours."""

import abc
from typing import ClassVar

import numpy as np

from solfer.config.records.conventions import AnglesRecord, ConventionRecord
from solfer.errors import NotFinite, PipeError, nearest
from solfer.interfaces.geometry import bare_frame
from solfer.numerics.rotations import (
    QuaternionConvention,
    normalize,
    quaternion_from_rotation,
    rotation_from_angles,
    rotation_from_quaternion,
)
from solfer.transport.inexact import InexactOrientations
from solfer.transport.messages import BodyMessage, ImuMessage, Message, VectorMessage

LACKING = (
    frozenset[str](),
    frozenset(("orientation",)),
    frozenset(("angular",)),
    frozenset(("orientation", "angular")),
)
"""What an inertial measurement unit lacks, by what `read_imu` returns."""

TOP_SPEED = 50.0
"""No legged or wheeled robot is as fast [m/s]."""

TOP_RATE = 60.0
"""Nor as this; gyroscopes end at 35 rad/s, 2000 degrees/s [rad/s]."""

CHART_AXES = (0, 1, 2)
"""Turns of the chart of a floating base: about x, then y, then z."""


class BodyReading(abc.ABC):
    """Reads one type of message.

    Args:
        body: The sender's name of the body.
        convention: How the sender writes orientation and twist.
        axes: Order of the turns, of an orientation that is three angles.

    Attributes:
        carries: Content of the message, of: position, orientation, linear, angular.
        values: Orientation from the body to the world as a Hamilton quaternion (x, y, z, w), position in the world [m],
            linear [m/s] and angular velocity [rad/s], shape (13,); values that the message lacks stay zero.
        own_axes: Whether the twist is in the axes of the body, not in those of the world.
        force: Specific force in the axes of the body, shape (3,) [m/s^2]; zeros if it is not measured.
        lacks: What the newest message lacks of what its type carries.
    """

    carries: ClassVar[frozenset[str]]

    def __init__(self, body: str, convention: ConventionRecord, axes: tuple[int, int, int] = CHART_AXES):
        self._body = body
        self._axes = axes
        self._twist_frame = convention.twist.frame
        orientation = convention.orientation
        self._inexact = InexactOrientations()
        self._convention = QuaternionConvention(orientation.order, orientation.convention)
        self._as_prescribed = orientation.order == "xyzw" and orientation.convention == "HAMILTONIAN"
        self.values = np.zeros(13)
        self.own_axes = False
        self.force = np.zeros(3)
        self.lacks: frozenset[str] = frozenset()
        # imported here: its compiler takes a while to load
        from solfer.numerics.checks.imu import plausible, read_imu

        self._is_plausible = plausible
        self._read_imu = read_imu
        self._quaternion = self.values[:4]
        self._position = self.values[4:7]
        self._twist = self.values[7:]
        self._quaternion[3] = 1.0

    def read(self, message: Message) -> None:
        """Read the values of a message.

        Raises:
            PipeError: It describes another body, its orientation is not a unit quaternion, or no robot is as fast.
            NotFinite: A value is NaN or infinite.
        """
        self._read_values(message)
        if self._is_plausible(self.values, TOP_SPEED, TOP_RATE):
            return
        if not np.isfinite(self.values).all():
            raise NotFinite("a position or a velocity that is not a finite number")
        speed, rate = np.abs(self.values[7:].reshape(2, 3)).max(axis=1).tolist()
        if rate >= TOP_RATE:
            raise PipeError(f"an angular velocity of {rate:.3g} rad/s", expected=f"{TOP_RATE:g} rad/s at most")
        raise PipeError(f"a velocity of {speed:.3g} m/s", expected=f"{TOP_SPEED:g} m/s at most")

    def check_body(self, message: Message) -> None:  # noqa: B027 most messages name no body
        """Check that a message describes this body.

        Raises:
            PipeError: It describes another one.
        """

    @abc.abstractmethod
    def _read_values(self, message: Message) -> None:
        """Read the values; those that are not in the orientation need no check."""

    def _check_name(self, name: str) -> None:
        if bare_frame(name) != self._body:
            raise PipeError(
                f"it describes '{name}'",
                expected=f"'{self._body}', or the key 'reference' in the pipe",
                names=nearest(name, (self._body,)),
            )

    def _orient(self, quaternion: np.ndarray, sender: str) -> None:
        self._convention.read(quaternion, self._quaternion)
        if normalize(self._quaternion):
            self._inexact.report(sender)


class OdometryReading(BodyReading):
    """nav_msgs/Odometry; it prescribes a twist in the axes of the body."""

    carries = frozenset(("position", "orientation", "linear", "angular"))

    def check_body(self, message: BodyMessage) -> None:
        """See `BodyReading.check_body`."""
        self._check_name(message.child)

    def _read_values(self, message: BodyMessage) -> None:
        self._check_name(message.child)
        self._orient(message.orientation, message.sender)
        self._position[:] = message.position
        self._twist[:3], self._twist[3:] = message.linear, message.angular
        if not self._as_prescribed or self._twist_frame == "world":
            # back to the sender's own values: it does not follow the prescription of the message
            prescribed = rotation_from_quaternion(message.orientation)
            self._twist[:3], self._twist[3:] = message.linear @ prescribed, message.angular @ prescribed
            self.own_axes = self._twist_frame != "world"


class ImuReading(BodyReading):
    """sensor_msgs/Imu; it prescribes an angular velocity in the axes of the sensor."""

    carries = frozenset(("orientation", "angular"))

    def _read_values(self, message: ImuMessage) -> None:
        if message.frame != self._body:
            self._check_name(message.frame)
        numbers = (message.orientation, message.angular, message.acceleration)
        try:
            lacks = self._read_imu(*numbers, self.values, self.force)
        except TypeError:  # a message that was made in Python has other numbers than the kernel's
            lacks = self._read_imu(*map(_doubles, numbers), self.values, self.force)
        self.lacks = LACKING[lacks]
        if "orientation" not in self.lacks:
            self._orient(message.orientation, message.sender)
        self.own_axes = self._twist_frame != "world"


class PoseReading(BodyReading):
    """geometry_msgs/PoseStamped."""

    carries = frozenset(("position", "orientation"))

    def _read_values(self, message: VectorMessage) -> None:
        self._orient(message.values[3:], message.sender)
        self._position[:] = message.values[:3]


class QuaternionReading(BodyReading):
    """geometry_msgs/QuaternionStamped."""

    carries = frozenset(("orientation",))

    def _read_values(self, message: VectorMessage) -> None:
        self._orient(message.values, message.sender)


class AnglesReading(BodyReading):
    """geometry_msgs/Vector3Stamped: angles about x, y and z."""

    carries = frozenset(("orientation",))

    def _read_values(self, message: VectorMessage) -> None:
        if not np.isfinite(message.values).all():
            raise NotFinite("an angle that is not a finite number")
        self._quaternion[:] = quaternion_from_rotation(rotation_from_angles(message.values.tolist(), self._axes))


class TwistReading(BodyReading):
    """geometry_msgs/TwistStamped; the frame of its header names the axes."""

    carries = frozenset(("linear", "angular"))

    def _read_values(self, message: VectorMessage) -> None:
        frame = self._twist_frame or ("body" if bare_frame(message.frame) == self._body else "world")
        self.own_axes = frame == "body"
        self._twist[:] = message.values


def _doubles(numbers: object) -> np.ndarray:
    """Return numbers of any type as an array; a PipeError if they are none."""
    try:
        return np.ascontiguousarray(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        raise PipeError(f"{numbers!r:.80} where numbers belong", expected="an array of float64") from None


READINGS: dict[str, type[BodyReading]] = {
    "nav_msgs/Odometry": OdometryReading,
    "sensor_msgs/Imu": ImuReading,
    "geometry_msgs/PoseStamped": PoseReading,
    "geometry_msgs/QuaternionStamped": QuaternionReading,
    "geometry_msgs/Vector3Stamped": AnglesReading,
    "geometry_msgs/TwistStamped": TwistReading,
}
"""Readings of messages of a rigid body, by the messages' canonical name."""


def turns(record: AnglesRecord | None) -> tuple[int, int, int]:
    """Return the order of the turns that a pipe is configured for."""
    return CHART_AXES if record is None else record.axes()
