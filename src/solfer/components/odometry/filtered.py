"""Where the base is, from wheels that roll and a gyroscope, by a Kalman filter that knows how well it knows."""

import math

import numpy as np

from solfer.components.odometry.contact_kalman import ContactKalman
from solfer.components.odometry.measured_base import MeasuredBase
from solfer.components.odometry.rolling import AT_REST, RollingOdometry
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels

ENCODERS = 3e-3
"""Deviation of what encoders of wheels and legs tell of a velocity [m/s]."""

STANDING = 1e-5
"""The same of a robot that rests [m/s]."""

SLIP = 0.02
"""Deviation of a wheel's velocity as a share of it."""

MOVING = 0.02
"""Speed above which joints that all stand still are joints of which nothing was told [m/s]."""

GROUND = 0.005
"""Deviation of the height of level ground [m]."""

_POSE = np.ix_((0, 1, 2, 5), (0, 1, 2, 5))
"""Position and heading in a covariance of a pose."""


class FilteredOdometry(RollingOdometry):
    """The pose of `RollingOdometry`, whose way and turn are those of a Kalman filter, with a covariance.

    Wheels that contradict the others are left out as there, and those besides that contradict what the filter expects.
    While nothing is told of the joints the base goes on with its velocity; what they tell then covers that time.

    Args:
        wheels: The wheels.
        base: What the IMU tells.
        tags: Tags of the configuration.

    Attributes:
        kalman: The filter.
    """

    def __init__(self, wheels: Wheels, base: MeasuredBase, tags: OdometryTags):
        self.kalman = ContactKalman(
            len(wheels), tags.acceleration, tags.gyro_noise, tags.gyro_bias, tags.gyro_walk, tags.radius_share
        )
        super().__init__(wheels, base, tags)
        self._deviations, self._way, self._guessed = np.zeros(len(wheels)), np.zeros(3), np.zeros(3)
        self._gap = 0.0
        self._tilt = math.radians(tags.tilt_deviation) ** 2

    def start(self) -> None:
        """See `RollingOdometry.start`; the pose is known then."""
        self.kalman.start()
        self._gap, self._guessed[:] = 0.0, 0.0
        super().start()

    def place(self, x: float, y: float, heading: float) -> None:
        """See `RollingOdometry.place`; the pose is known then."""
        self.kalman.place()
        super().place(x, y, heading)

    def write_covariance(self, pose: np.ndarray) -> None:
        """Write the covariance of the pose, shape (6, 6), linear first: position and turns in world axes."""
        pose[:] = 0.0
        pose[_POSE] = self.kalman.covariance[:4, :4]
        pose[3, 3] = pose[4, 4] = self._tilt

    def _fuse(self, period: float) -> tuple[np.ndarray, float]:
        told, time = self._listen(period)
        gyroscope, unknown = (told - self._pending, 0.0) if time else self._wheels_turn()
        kalman = self.kalman
        expected = gyroscope - kalman.bias * time
        kalman.accelerate(expected, period)
        self._doubt(expected, period)
        waited, silent = self._gap, not self._step.any() and float(np.linalg.norm(kalman.velocity)) > MOVING
        self._gap = waited + period if silent else 0.0
        if not silent:
            self._correct(gyroscope / period, time / period, waited + period)
        turn = gyroscope - kalman.bias * time
        kalman.advance(self.heading + 0.5 * turn, period, time, unknown)
        if self._wheels.is_level:
            kalman.settle(GROUND * math.sqrt(self._tags.settle / period))
        self.rate.bias, self.rate.variance = kalman.bias, kalman.bias_variance
        self._note_turn(turn, told)
        # who rises is seen by what all tell against the way of the base
        self.consensus.mean(self._told, self._arms, turn, self._weights)
        self._go(period, silent, waited > 0.0)
        return self._way, turn

    def _correct(self, rate: float, share: float, time: float) -> None:
        """Take the ways that wheels tell of a time [s]; `rate` and `share` are those of `ContactKalman.correct`."""
        np.divide(self._told, time, out=self._speeds)
        np.sqrt(np.einsum("ij,ij->i", self._speeds, self._speeds), out=self._deviations)
        self._deviations *= SLIP
        self._deviations += STANDING if self._rest > AT_REST else ENCODERS
        believed = self.consensus.believed
        believed &= self._weights > 0.0
        self.kalman.correct(self._speeds, self._arms, rate, share, self._deviations, believed)

    def _go(self, period: float, silent: bool, after_gap: bool) -> None:
        """Compute the way of a cycle; after a gap it is what the wheels tell of all of it, less what was guessed."""
        if after_gap and not silent:
            np.subtract(self.consensus.motion, self._guessed, out=self._way)
        else:
            np.multiply(self.kalman.velocity, period, out=self._way)
        self._guessed += self._way
        self._guessed *= silent

    def _wheels_turn(self) -> tuple[float, float]:
        """Return the turn that wheels tell [rad], and its variance, where the gyroscope tells nothing."""
        weights = self._trusted()
        turn, spread = self.consensus.turn(self._told, self._arms, weights)
        deviation = SLIP * float(np.abs(self._told).max()) + 1e-6
        return turn, deviation * deviation * float(weights.max()) / max(spread, 1e-9)
