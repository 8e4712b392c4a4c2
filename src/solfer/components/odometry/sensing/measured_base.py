"""Orientation and angular velocity of the base by the IMU, in a State that an odometry writes itself."""

import math
from typing import NamedTuple

import numpy as np

from solfer.components.odometry import filter_kernel
from solfer.numerics.base_chart import BaseChart
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion
from solfer.numerics.twist_transport import BaseKinematics
from solfer.robot import Robot


class VelocityChange(NamedTuple):
    """What an accelerometer measures.

    Attributes:
        change: Change of its velocity since it was measured the last time in the State's world, shape (3,) [m/s]; live.
            NaN: nothing is known of it.
        place: From the base's origin to it in the base, shape (3,) [m]; live.
    """

    change: np.ndarray
    place: np.ndarray


class MeasuredBase:
    """Orientation and angular velocity of the base as a pipe has written them, and what has changed.

    Args:
        robot: The Robot.

    Attributes:
        averages: Whether `angular` is the mean since the measurement before, and not that of one moment.
        shakes: Whether the base tilts to and fro so fast that a mean of rates belongs to the middle of its interval;
            wheels are too calm for that.
        fresh: Whether the IMU has a new sample.
        velocity_change: What its accelerometer measures; to be set before `start`.
        rotation: Rotation from the base to the State's world, shape (3, 3).
        heading: Angle about the vertical from the State's world to the base's x axis [rad].
        turned: Rotation vector of the base since the sample before, in the heading frame, shape (3,) [rad]; zero
            without a new one.
        angular: Newest angular velocity of the base in the heading frame, shape (3,) [rad/s].
    """

    def __init__(self, robot: Robot):
        self.averages = self.shakes = False
        chart = robot.kinematics.base
        self._motion = BaseKinematics(chart if chart is not None else BaseChart())
        self._state = robot.state
        self._rates, self._middle, self._pose = np.zeros((3, 6))
        self.fresh = True
        self.velocity_change = VelocityChange(np.full(3, math.nan), np.zeros(3))
        self.rotation = self._known = np.eye(3)
        self.turned, self.angular = np.zeros((2, 3))
        self.heading = 0.0

    def start(self) -> None:
        """Begin with the orientation of now."""
        self._pose[:] = self._state.position[:6]
        self._read()
        self._measure()
        self._known = self.rotation
        self.fresh = True
        self.turned[:] = 0.0

    def read(self, measured: bool) -> None:
        """Find out what has changed in the State; only if `measured` is it new, else the odometry has written it."""
        self.fresh = measured
        self.turned[:] = 0.0
        self._read()
        if measured:
            self._measure()
            if not filter_kernel.turned(self.rotation, self._known, self.heading, self.turned):
                self.turned[:] = about_vertical(rotation_vector(self.rotation @ self._known.T), -self.heading)
            self._known = self.rotation

    def _read(self) -> None:
        self._rates[3:] = self._state.velocity[3:6]
        self._motion.update(self._state.position, self._rates)
        self.rotation = self._motion.rotation.copy()
        self.heading = math.atan2(self.rotation[1, 0], self.rotation[0, 0])

    def _measure(self) -> None:
        if self.averages and self.shakes:
            # half an interval late, the product of two rates that go together would turn the heading
            turned = self._state.position[:6] - self._pose
            self._pose += turned
            turned -= math.tau * np.round(turned / math.tau)
            np.subtract(self._pose, 0.5 * turned, out=self._middle)
            self._motion.update(self._middle, self._rates)
        self.angular[:] = about_vertical(self._motion.velocity[3:], -self.heading)

    def subtract_tilt(self, x: float, y: float) -> None:
        """Subtract an error of the tilt, rotations about x and y of the heading frame [rad]; the next lacks it."""
        cosine = math.cos(self.heading)
        sine = math.sin(self.heading)
        x, y = cosine * x - sine * y, sine * x + cosine * y
        half = 0.5 * math.hypot(x, y)
        factor = 0.5 * math.sin(half) / half if half else 0.5
        self.rotation = rotation_from_quaternion((-factor * x, -factor * y, 0.0, math.cos(half))) @ self.rotation
        self.heading = math.atan2(self.rotation[1, 0], self.rotation[0, 0])


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Compute axis times angle of a rotation matrix, shape (3,) [rad]; the angle is at most pi."""
    quaternion = quaternion_from_rotation(rotation)
    sine = float(np.linalg.norm(quaternion[:3]))
    if sine < 1e-12:
        return 2.0 * quaternion[:3]
    return 2.0 * float(np.arctan2(sine, quaternion[3])) / sine * quaternion[:3]


def about_vertical(vector: np.ndarray, angle: float) -> np.ndarray:
    """Turn a vector about the vertical by an angle [rad], shape (3,); a new array."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    x, y, z = vector.tolist()
    return np.array((cosine * x - sine * y, sine * x + cosine * y, z))
