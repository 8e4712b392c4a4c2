"""Where the base is, from wheels that roll and a gyroscope, by a Kalman filter that knows how well it knows."""

import math

import numpy as np

from solfer.components.odometry import motion_kernel
from solfer.components.odometry.agreement.majority import COMPARED, Majority
from solfer.components.odometry.contact_kalman import ContactKalman
from solfer.components.odometry.ground.tracks import GroundTracks
from solfer.components.odometry.measured_base import MeasuredBase, about_vertical
from solfer.components.odometry.rolling import AT_REST, RollingOdometry
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels

ENCODERS = 2e-3
"""Deviation of what encoders of wheels and legs tell of a velocity [m/s]."""

STANDING = 1e-5
"""The same of a robot that rests [m/s]."""

SLIP, SKID = 0.008, 0.02
"""Deviation of a wheel's velocity as a share of it, and of its way in a cycle where wheels alone tell the turn."""

MOVING = 0.02
"""Speed above which joints that all stand still are joints of which nothing was told [m/s]."""

GROUND = 0.005
"""Deviation of the height of level ground [m]."""

SILENT = 1e-6
"""Angular velocity below which a gyroscope tells nothing [rad/s]: no real one is as quiet."""

LOOKS = 10
"""Cycles from one look at the tilt to the next: grounds and IMUs err for longer."""

SETTLE, RAISING = 0.005, 0.2
"""Time in which the base comes to the height that wheels know [s], and how fast it does at most [m/s]."""

LENGTH, MEMORY, COMMON = 1.0, 3.0, 1e-3
"""Way on which wheels are compared that slide, how long that is remembered [m], and what they may slide all alike,
which is not seen [m/sqrt(m)]."""

SHAKES, SHAKING = 2.5e-3, 0.3
"""What samples of a gyroscope miss while legs move, as a share of the speed of their joints, and for how long [s]: the
base shakes in time with the commands."""

CRAWLING = 0.15
"""Speed below which encoders are too coarse to tell on which slopes wheels are [m/s]."""

QUIET, DEAF = 5e-4, 1.0
"""Velocity by which wheels differ that roll and do not slide [m/s], and the variance of a turn of which a gyroscope
tells nothing [rad^2/s^2]."""

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
        self._deviations, self._way, self._guessed = np.zeros(len(wheels)), np.zeros(3), np.zeros(3)
        self._gap, self._gyroscope = 0.0, tags.gyro_noise**2
        self._arm, self._before_tilt, self._change, self._lean = np.zeros(3), np.zeros(2), np.zeros(2), np.zeros(3)
        self._rate, self._rate_before = np.zeros((2, 3))
        self._shaken, self._leg_speed, self._looks, self._unseen = 0.0, 0.0, 0, 0.0
        self._tracks = GroundTracks(np.array(wheels.radii))
        self._floor, self._floor_variance, self._gone, self._learned = math.nan, 0.0, 0.0, np.zeros(1)
        self._apart, self._together = np.zeros((len(wheels), 3)), np.ones(len(wheels), dtype=bool)
        self._majority, self._trust = Majority(len(wheels)), np.zeros(len(wheels))
        self._rests, self._period, self._rolled = np.zeros(len(wheels)), 1.0, 0.0

    def start(self) -> None:
        """See `RollingOdometry.start`; the pose is known then."""
        self.kalman.start()
        self._gap, self._guessed[:], self._rests[:] = 0.0, 0.0, 0.0
        self._majority.start()
        self._shaken, self._looks, self._unseen = 0.0, 0, 0.0
        super().start()
        self._find_axes()
        self._rate_before[:] = self._base.angular
        self._tracks.start(0.0 if self._wheels.is_level else math.nan)
        self._floor, self._floor_variance = self._tracks.floor, 0.0
        self._gone, self._apart[:], self._trust[:], self._together[:] = 0.0, 0.0, 0.0, True
        self._look_at_ground()
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
        self._tracks.forget()
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
        white = self._gyroscope / self._period
        errors, bias = self.kalman.covariance, self.kalman.bias_variance
        motion_kernel.write_covariances(errors, self.heading, self._arm, white, bias, pose, twist)

    def _find_axes(self) -> None:
        """Find how the axes of the base stand in those of the heading."""
        motion_kernel.turn_rotation(self._base.rotation, -self._base.heading, self.kalman.axes)

    def _right(self, period: float) -> None:
        """Take the error of the tilt away, as it is known, and its change from the turn of the base."""
        base, kalman, self._period = self._base, self.kalman, period
        self._rolled = float(np.abs(self._step).max()) * self._wheels.radii[0]
        self._shaken = 0.0
        if not base.fresh:
            return
        turned, tilt, time = base.turned[:2], kalman.tilt, self._time + period
        self._find_axes()
        self._hear(time)
        if self._rest > AT_REST:
            tilt += turned  # a robot that rests does not turn
            turned[:] = 0.0
            kalman.rest(self._rate @ kalman.axes, time)
        else:
            np.copyto(self._before_tilt, tilt)
            rate = self._rate - kalman.biases
            np.subtract(turned, rate[:2] * time, out=self._change)
            kalman.lean(self._arm, self.heading, rate[2] * time, self._change, time, self._rolled, self._shaken)
            turned -= tilt
            turned += self._before_tilt
        np.divide(turned, time, out=base.angular[:2])
        self._wheels.right(*tilt.tolist())

    def _hear(self, time: float) -> None:
        """Take what the gyroscope tells on average for a time [s], and how much it may have missed."""
        base, rate = self._base, self._rate
        told = base.angular if float(np.abs(base.angular).max()) > SILENT else base.turned / time
        np.add(told, self._rate_before, out=rate)
        rate *= 0.5
        np.subtract(told, self._rate_before, out=self._rate_before)
        self._shaken = 0.25 * float(self._rate_before @ self._rate_before) / 3.0
        self._leg_speed = float(np.abs(self._step[self._wheels.legs]).max()) / self._period
        self._shaken += (SHAKES * self._leg_speed) ** 2 * 2.0 * SHAKING / self._period
        self._rate_before[:] = told

    def _listen(self, period: float) -> tuple[float, float]:
        """See `RollingOdometry._listen`; the gyroscope counts, and not what an IMU makes of it."""
        self._time += period
        time = self._time if self._base.fresh else 0.0
        told = float(self._rate[2]) * time
        self._note_rest(told, time, period)
        return told, time

    def _fuse(self, period: float) -> tuple[np.ndarray, float]:
        told, time = self._listen(period)
        gyroscope, unknown = (told - self._pending, 0.0) if time else self._wheels_turn()
        kalman = self.kalman
        expected = gyroscope - kalman.bias * time
        kalman.accelerate(expected, period, self._rolled, self._shaken)
        self._doubt(expected, period)
        waited, silent = self._gap, not self._step.any() and math.hypot(*kalman.velocity.tolist()) > MOVING
        self._gap = waited + period if silent else 0.0
        self._find_lean()
        if not silent:
            self._correct(gyroscope / period, time / period, waited + period)
        turn = gyroscope - kalman.drift * time
        kalman.advance(self.heading + 0.5 * turn, period, time, unknown)
        self._settle(period)
        self.position += kalman.step[:3]
        turn += float(kalman.step[3])
        kalman.step[:] = 0.0
        self.rate.bias, self.rate.variance = kalman.bias, kalman.bias_variance
        self._note_turn(turn, float(self._base.turned[2]))
        # who rises is seen by what all tell against the way of the base
        self.consensus.mean(self._told, self._arms, turn, self._weights)
        self._slide(period)
        self._go(period, silent, waited > 0.0)
        return self._way, turn

    def _advance(self, motion: np.ndarray, turn: float, period: float) -> None:
        """Move the base, in the middle of the turn, to the height that wheels know."""
        self.position += about_vertical(motion, self.heading + 0.5 * turn)
        self.heading = self._base.heading + self._offset if self._base.fresh else self.heading + turn
        tracks, wheels, weights = self._tracks, self._wheels, self._trusted()
        missing = tracks.anchor(
            wheels.arms, wheels.normal, self.position, self.heading, weights, self.kalman.velocity, turn / period
        )
        most = RAISING * period
        raised = 0.0 if math.isnan(missing) else min(max(missing * period / (SETTLE + period), -most), most)
        self.position[2] += raised
        tracks.note(raised, weights)

    def _settle(self, period: float) -> None:
        """Take the height for known where the robot is on a floor: as well as the floor's height was known first."""
        tracks, variance = self._tracks, float(self.kalman.covariance[2, 2])
        if not tracks.level:
            return
        if tracks.floor != self._floor:
            self._floor, self._floor_variance = tracks.floor, variance
        if variance > self._floor_variance + GROUND * GROUND:
            self.kalman.settle(GROUND * math.sqrt(self._tags.settle / period))

    def _slide(self, period: float) -> None:
        """Learn by how much wheels slide, from how far they get away from each other within a way."""
        x, y, _ = self.kalman.velocity.tolist()
        way = math.hypot(x, y) * period
        self._gone += way
        motion_kernel.part_ways(self.consensus.rest, self._majority.shares, way, self._apart, self._trust)
        self._together &= self.consensus.believed
        if self._gone >= LENGTH:
            if motion_kernel.slid(self._apart, self._trust, self._together, self._learned):
                share = self._gone / (self._gone + MEMORY)
                each = COMMON * COMMON + self._learned[0] / self._gone
                self.kalman.slide += share * (each - self.kalman.slide)
            self._gone, self._apart[:], self._trust[:], self._together[:] = 0.0, 0.0, 0.0, True

    def _find_lean(self) -> None:
        """Compute how far the mean of the contacts would go by the tilting of the base alone [m]."""
        np.divide(self._weights @ self._arms, self._weights.sum(), out=self._arm)
        (px, py, _), (x, y, z) = self._base.turned.tolist(), self._arm.tolist()
        self._lean[:] = py * z, -px * z, px * y - py * x

    def _find_ground(self) -> bool:
        """See `RollingOdometry`; level ground tells the error of the tilt."""
        found = super()._find_ground()
        if self._base.fresh:
            self._looks, self._unseen = self._looks + 1, self._unseen + self._period
            if self._looks >= LOOKS:
                self.kalman.right(self._unseen)
                self._looks, self._unseen = 0, 0.0
                if found:
                    self._look_at_ground()
        return found

    def _look_at_ground(self) -> bool:
        """Take the plane through the contacts for level ground, if it can be; return whether it was."""
        if not (self._tracks.level and motion_kernel.plane(self._weights, self._wheels.arms, self._slope)):
            return False
        (x, y), (a, b) = self.kalman.tilt.tolist(), self._slope.tolist()
        return self.kalman.level(x + b, y - a)

    def _correct(self, rate: float, share: float, time: float) -> None:
        """Take the ways that wheels tell of a time [s]; `rate` and `share` are those of `ContactKalman.correct`."""
        kalman, speeds, believed = self.kalman, self._speeds, self.consensus.believed
        least = STANDING if self._rest > AT_REST else ENCODERS
        motion_kernel.contradict(self._told, self._lean, time, SLIP, least, self._rests, self._deviations, speeds)
        believed &= self._weights > 0.0
        kalman.scrub(self._contradiction(rate - share * kalman.bias, share > 0.0, time))
        self._deviations *= 1.0 + self._majority.far / self._tolerance()
        kalman.correct(speeds, self._arms, rate, share, self._deviations, believed)
        turned = rate - share * kalman.drift
        keep = CONTRADICTION / (CONTRADICTION + time)
        motion_kernel.learn(speeds, kalman.velocity, turned, self._arms, believed, keep, self._rests)

    def _tolerance(self) -> float:
        """Return the variance by which wheels differ that roll [m^2/s^2]: encoders, and radii that are not known."""
        x, y, _ = self.kalman.velocity.tolist()
        speed = math.hypot(x, y)
        # wheels on slopes that differ by an angle go up by its sine, and by 1 - cosine less ahead
        sloped = 0.0 if self._tracks.level else 1.5 * float(self._rests.max()) / max(speed, CRAWLING)
        return QUIET * QUIET + (self._tags.radius_share * speed) ** 2 + sloped * sloped

    def _contradiction(self, turn: float, heard: bool, time: float) -> float:
        """Compare wheels with each other and with a turn [rad/s], which the gyroscope has told if it was heard."""
        shakes = SHAKES * self._leg_speed
        unsure = self._gyroscope / COMPARED + self.kalman.bias_variance + shakes * shakes if heard else DEAF
        believed = self.consensus.believed
        return self._majority.hear(self._speeds, self._arms, believed, turn, unsure, time, self._tolerance())

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
        deviation = SKID * float(np.abs(self._told).max()) + 1e-6
        return turn, deviation * deviation * float(weights.max()) / max(spread, 1e-9)
