"""Where the base is, from wheels that roll and a gyroscope, by a Kalman filter that knows how well it knows."""

import math

import numpy as np

from solfer.components.odometry import motion_kernel
from solfer.components.odometry.contact_kalman import RIGHTING, ContactKalman
from solfer.components.odometry.measured_base import MeasuredBase
from solfer.components.odometry.rolling import AT_REST, SHARE_OF_WAY, RollingOdometry
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels

ENCODERS = 2e-3
"""Deviation of what encoders of wheels and legs tell of a velocity [m/s]."""

STANDING = 1e-5
"""The same of a robot that rests [m/s]."""

SLIP = 0.01
"""Deviation of a wheel's velocity as a share of it."""

MOVING = 0.02
"""Speed above which joints that all stand still are joints of which nothing was told [m/s]."""

GROUND = 0.005
"""Deviation of the height of level ground [m]."""

CONTRADICTION = 0.1
"""Time over which wheels are compared, which doubt what they tell where they contradict each other [s]."""


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
            len(wheels),
            tags.acceleration,
            tags.gyro_noise,
            tags.gyro_bias,
            tags.gyro_walk,
            tags.radius_share,
            math.radians(tags.tilt_deviation),
        )
        super().__init__(wheels, base, tags)
        self._variances, self._way, self._guessed = np.zeros((len(wheels), 3)), np.zeros(3), np.zeros(3)
        self._gap, self._gyroscope = 0.0, tags.gyro_noise**2
        self._arm, self._righted, self._lean = np.zeros(3), np.zeros(2), np.zeros(3)
        self._rates, self._biases, self._variances_of_biases = np.zeros((3, 2))
        self._known = tags.gyro_bias**2
        self._rests, self._period, self._rolled = np.zeros(len(wheels)), 1.0, 0.0

    def start(self) -> None:
        """See `RollingOdometry.start`; the pose is known then."""
        self.kalman.start()
        self._gap, self._guessed[:], self._rests[:] = 0.0, 0.0, 0.0
        self._biases[:], self._known = 0.0, self._tags.gyro_bias**2
        super().start()
        self._rates[:] = self._base.angular[:2]
        self._find_ground()
        self._base.right(*self.kalman.tilt.tolist())
        self._wheels.right(*self.kalman.tilt.tolist())
        self.position[2] = -self._mean_height()
        self._base.angular[:2] = 0.0
        self._remember()
        self._find_lean()
        self._move()

    def place(self, x: float, y: float, heading: float) -> None:
        """See `RollingOdometry.place`; the pose is known then."""
        self.kalman.place()
        super().place(x, y, heading)

    def update(self, period: float) -> None:
        """See `RollingOdometry.update`."""
        super().update(period)
        if self._base.fresh:
            self._base.right(*self.kalman.tilt.tolist())

    def write_covariance(self, pose: np.ndarray, twist: np.ndarray) -> None:
        """Write the covariances of the pose, in world axes, and of the twist, in those of the heading.

        Args:
            pose: Of position and turns, shape (6, 6) [m, rad].
            twist: Of velocity and angular velocity, shape (6, 6) [m/s, rad/s].
        """
        kalman, white, told = self.kalman, self._gyroscope / self._period, self._variances_of_biases
        told[0], told[1] = self._known if kalman.follows else 0.0, kalman.bias_variance
        # where tilts are those of the IMU, what it rights is taken for turns
        drift = 0.0 if kalman.follows else RIGHTING**-2
        motion_kernel.write_covariances(kalman.covariance, self.heading, self._arm, drift, white, told, pose, twist)

    def _right(self, period: float) -> None:
        """Take the error of the tilt away, as it is known, and its change from the turn of the base."""
        base, kalman, self._period = self._base, self.kalman, period
        self._rolled = float(np.abs(self._step).max()) * self._wheels.radii[0]
        if not base.fresh:
            return
        turned, tilt, time = base.turned[:2], kalman.tilt, self._time + period
        # between two samples the mean of both
        (x, y), (x0, y0) = base.angular[:2].tolist(), self._rates.tolist()
        self._rates[:] = base.angular[:2]
        if self._rest > AT_REST:
            tilt += turned  # a robot that rests does not turn
            turned[:] = 0.0
            self._learn_biases(x, y, time)
        else:
            (bx, by), (px, py) = self._biases.tolist(), turned.tolist()
            more = (px - (0.5 * (x + x0) - bx) * time, py - (0.5 * (y + y0) - by) * time)
            self._known += self._tags.gyro_walk**2 * time
            np.copyto(self._righted, tilt)
            kalman.lean(self._arm, self.heading, time, self._rolled, more, self._known)
            self._righted -= tilt
            turned += self._righted
        np.divide(turned, time, out=base.angular[:2])
        self._wheels.right(*tilt.tolist())

    def _learn_biases(self, x: float, y: float, time: float) -> None:
        """Take what the gyroscope tells about x and y at rest [rad/s], within a time [s], for its biases."""
        gain = self._known / (self._known + self._gyroscope / time)
        bx, by = self._biases.tolist()
        self._biases[:] = bx + gain * (x - bx), by + gain * (y - by)
        self._known *= 1.0 - gain

    def _fuse(self, period: float) -> tuple[np.ndarray, float]:
        told, time = self._listen(period)
        gyroscope, unknown = (told - self._pending, 0.0) if time else self._wheels_turn()
        kalman = self.kalman
        expected = gyroscope - kalman.bias * time
        kalman.accelerate(expected, period, self._rolled)
        self._doubt(expected, period)
        waited, silent = self._gap, not self._step.any() and math.hypot(*kalman.velocity.tolist()) > MOVING
        self._gap = waited + period if silent else 0.0
        self._find_lean()
        if not silent:
            self._correct(gyroscope / period, time / period, waited + period)
        turn = gyroscope - kalman.drift * time
        kalman.advance(self.heading + 0.5 * turn, period, time, unknown)
        if self._wheels.is_level:
            kalman.settle(GROUND * math.sqrt(self._tags.settle / period))
        self.position += kalman.step[:3]
        turn += float(kalman.step[3])
        kalman.step[:] = 0.0
        self.rate.bias, self.rate.variance = kalman.bias, kalman.bias_variance
        self._note_turn(turn, told)
        # who rises is seen by what all tell against the way of the base
        self.consensus.mean(self._told, self._arms, turn, self._weights)
        self._go(period, silent, waited > 0.0)
        return self._way, turn

    def _find_lean(self) -> None:
        """Compute how far the mean of the contacts would go by the tilting of the base alone [m]."""
        np.divide(self._weights @ self._arms, self._weights.sum(), out=self._arm)
        (px, py, _), (x, y, z) = self._base.turned.tolist(), self._arm.tolist()
        self._lean[:] = py * z, -px * z, px * y - py * x

    def _find_ground(self) -> bool:
        """See `RollingOdometry`; level ground tells the error of the tilt."""
        found = super()._find_ground()
        if found and self._wheels.is_level and self._base.fresh:
            (x, y), (a, b) = self.kalman.tilt.tolist(), self._slope.tolist()
            self.kalman.level(x + b, y - a)
        return found

    def _correct(self, rate: float, share: float, time: float) -> None:
        """Take the ways that wheels tell of a time [s]; `rate` and `share` are those of `ContactKalman.correct`."""
        kalman, speeds, believed = self.kalman, self._speeds, self.consensus.believed
        least = STANDING if self._rest > AT_REST else ENCODERS
        told, tilted = self._told, self._base.turned
        motion_kernel.contradict(
            told, self._arms, tilted, self._lean, time, SLIP, least, self._rests, self._variances, speeds
        )
        believed &= self._weights > 0.0
        kalman.correct(speeds, self._arms, rate, share, self._variances, believed)
        turned = rate - share * kalman.drift
        keep = CONTRADICTION / (CONTRADICTION + time)
        motion_kernel.learn(speeds, kalman.velocity, turned, self._arms, believed, keep, self._rests)

    def _go(self, period: float, silent: bool, after_gap: bool) -> None:
        """Compute the way of a cycle; after a gap it is what the wheels tell of all of it, less what was guessed."""
        if after_gap and not silent:
            np.subtract(self.consensus.motion, self._guessed, out=self._way)
        else:
            np.multiply(self.kalman.velocity, period, out=self._way)
            self._way -= self._lean
        self._guessed += self._way
        self._guessed *= silent

    def _wheels_turn(self) -> tuple[float, float]:
        """Return the turn that wheels tell [rad], and its variance, where the gyroscope tells nothing."""
        weights = self._trusted()
        turn, spread = self.consensus.turn(self._told, self._arms, weights)
        deviation = SHARE_OF_WAY * float(np.abs(self._told).max()) + 1e-6
        return turn, deviation * deviation * float(weights.max()) / max(spread, 1e-9)
