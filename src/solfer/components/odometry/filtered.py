"""Where the base is, from wheels that roll and a gyroscope, by a Kalman filter that knows how well it knows."""

import math

import numpy as np

from solfer.components.odometry import motion_kernel
from solfer.components.odometry.agreement.majority import COMPARED, Majority
from solfer.components.odometry.consensus import Consensus
from solfer.components.odometry.contact_kalman import ContactKalman
from solfer.components.odometry.ground.tracks import GroundTracks
from solfer.components.odometry.measured_base import MeasuredBase, about_vertical
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels
from solfer.numerics.filters import LowPass
from solfer.points.contact.support_vertex import UP

FORGET = 2.0
"""Time in which a wheel's rise above the others is forgotten while it touches [s]."""

AT_REST = 0.1
"""Time for which wheels and joints have to stand still before the gyroscope's bias is learned [s]."""

SWAYING = 0.05
"""Share of the speed of a robot that rests which its joints may have on average: one that has stopped still sways."""

LIKELY, UNKNOWN = 5.0, 2e-3
"""Deviations that noise of a gyroscope has at most, and how fast a robot at rest may sway besides [rad/s]."""

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


class FilteredOdometry:
    """The base's pose and its covariance, by a Kalman filter of wheels that roll and an IMU.

    With the Jacobian J of the wheel's material at the contact i, the steps dq of the joints and the turn p of the
    base between two measurements, a wheel that rolls measures the base's way m_i = -(J_i dq + p x r_i), J and the
    arm r taken as the mean of both, which leaves an error of third order in the time between. Encoders count here,
    not velocities, so that no noise adds up. Wheels that are lifted, or contradict the others or what the filter
    expects, are left out. Where nothing new came of the joints the base goes on with its velocity; what comes then
    covers that time.

    Ground that rises less than `level` counts as level. On other ground its normal is that of the plane through the
    contacts. The height follows the tracks of the wheels.

    Args:
        wheels: The wheels.
        base: What the IMU measures.
        tags: Tags of the configuration.

    Attributes:
        kalman: The filter.
        position: Position of the base's origin in the world, shape (3,) [m]; live.
        heading: Angle about the vertical from the world to the base's x axis [rad].
        velocity: Velocity of the base's origin, axes of `Wheels`, shape (3,) [m/s]; live.
        angular: Angular velocity of the base, without the gyroscope's bias, the same axes, shape (3,) [rad/s]; live.
        lifted: Which wheels are lifted, shape (k,).
        consensus: Finds the wheels that are believed.
        filter: Filter of the angular velocity that the IMU measures, three numbers, or None.
        smoothing: Filter of the velocity and of the turn's rate, four numbers, or None.
    """

    def __init__(self, wheels: Wheels, base: MeasuredBase, tags: OdometryTags):
        count = len(wheels)
        self._wheels, self._base, self._tags, self._level = wheels, base, tags, math.tan(math.radians(tags.level))
        self.kalman = ContactKalman(
            count,
            tags.acceleration,
            tags.gyro_noise,
            tags.gyro_bias,
            tags.gyro_walk,
            tags.radius_share,
            math.radians(tags.tilt_deviation),
        )
        self.consensus = Consensus(count)
        self.filter: LowPass | None = None
        self.smoothing: LowPass | None = None
        self._moving, self._slope = np.zeros(4), np.zeros(2)
        self.position, self.velocity, self.angular = np.zeros((3, 3))
        self.heading = self._offset = self._pending = self._rest = self._time = 0.0
        self.lifted, self._rise = np.zeros(count, dtype=bool), np.zeros(count)
        self._weights = np.ones(count)
        self._told, self._slow, self._speeds, self._arms, self._arms_before = np.zeros((5, count, 3))
        self._jacobian = np.zeros_like(wheels.jacobian)
        self._step, self._before, self._sway = np.zeros((3, wheels.joints))
        self._deviations, self._way, self._guessed = np.zeros(count), np.zeros(3), np.zeros(3)
        self._gap, self._gyroscope = 0.0, tags.gyro_noise**2
        self._arm, self._before_tilt, self._change, self._lean = np.zeros(3), np.zeros(2), np.zeros(2), np.zeros(3)
        self._rate, self._rate_before = np.zeros((2, 3))
        self._shaken, self._leg_speed, self._looks, self._unseen = 0.0, 0.0, 0, 0.0
        self._tracks = GroundTracks(np.array(wheels.radii))
        self._floor, self._floor_variance, self._gone, self._learned = math.nan, 0.0, 0.0, np.zeros(1)
        self._apart, self._together = np.zeros((count, 3)), np.ones(count, dtype=bool)
        self._majority, self._trust = Majority(count), np.zeros(count)
        self._rests, self._period, self._rolled = np.zeros(count), 1.0, 0.0

    def start(self) -> None:
        """Begin above the origin, with the heading of the IMU, on level ground; the pose is known then."""
        base, wheels, kalman, tracks = self._base, self._wheels, self.kalman, self._tracks
        for low_pass in (self.filter, self.smoothing):
            if low_pass is not None:
                low_pass.reset()
        kalman.start()
        self._majority.start()
        base.start()
        wheels.set_normal(*UP)
        wheels.update(base.heading)
        self.heading, self._offset = base.heading, 0.0
        self._pending = self._rest = self._time = self._gap = self._shaken = self._unseen = self._gone = 0.0
        self._looks = 0
        self.lifted[:], self._together[:], self.consensus.believed[:] = False, True, True
        for numbers in (self._rise, self._slow, self._sway, self._guessed, self._rests, self._apart, self._trust):
            numbers[:] = 0.0
        self._weigh()
        self._find_axes()
        self._rate_before[:] = base.angular
        tracks.start(0.0 if wheels.is_level else math.nan)
        self._floor, self._floor_variance = tracks.floor, 0.0
        self._look_at_ground()
        base.right(*kalman.tilt.tolist())
        wheels.right(*kalman.tilt.tolist())
        self.position[:] = 0.0, 0.0, -self._mean_height()
        base.angular[:2] = 0.0
        self._remember()
        self._find_lean()
        self._move()

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the base somewhere else on the ground [m], with another heading [rad]; the pose is known then."""
        self.kalman.place()
        self._tracks.forget()
        self.position[:2] = x, y
        self._offset += heading - self.heading
        self.heading = heading

    def update(self, period: float, measured: bool) -> None:
        """Follow a measurement of the joints.

        Args:
            period: Time since the one before [s].
            measured: Whether the IMU has measured the base since then.
        """
        self._base.read(measured)
        self._wheels.update(self._base.heading)
        np.subtract(self._wheels.position, self._before, out=self._step)
        self._right(period)
        self._weigh()
        self._tell()
        self._advance(self._way, self._fuse(period), period)
        self._note_rises(period)
        self._find_ground()
        self._remember()
        self._move()
        if measured:
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
        """Find the mean rate of the gyroscope over a time [s], and how much it may have missed."""
        base, rate = self._base, self._rate
        measured = base.angular if float(np.abs(base.angular).max()) > SILENT else base.turned / time
        if base.averages:
            rate[:] = measured
        else:
            np.add(measured, self._rate_before, out=rate)
            rate *= 0.5
        np.subtract(measured, self._rate_before, out=self._rate_before)
        self._shaken = 0.25 * float(self._rate_before @ self._rate_before) / 3.0
        self._leg_speed = float(np.abs(self._step[self._wheels.legs]).max()) / self._period
        self._shaken += (SHAKES * self._leg_speed) ** 2 * 2.0 * SHAKING / self._period
        self._rate_before[:] = measured

    def _listen(self, period: float) -> tuple[float, float]:
        """Return the turn that the gyroscope measures [rad], and for which time [s]; zeros where nothing is new."""
        self._time += period
        time = self._time if self._base.fresh else 0.0
        turn = float(self._rate[2]) * time
        self._note_rest(turn, time, period)
        return turn, time

    def _fuse(self, period: float) -> float:
        """Correct the filter, write the way of the base, and return its turn about the vertical [rad]."""
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
        self._note_turn(turn, float(self._base.turned[2]))
        # who rises is seen by what all tell against the way of the base
        self.consensus.mean(self._told, self._arms, turn, self._weights)
        self._slide(period)
        self._go(period, silent, waited > 0.0)
        return turn

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

    def _find_ground(self) -> None:
        """Find the normal of the ground; level ground measures the error of the tilt."""
        found = bool(self._level) and motion_kernel.plane(self._weights, self._wheels.arms, self._slope)
        if found:
            (a, b), share = self._slope.tolist(), 1.0 if self._wheels.is_level else 0.7
            if math.hypot(a, b) > self._level * share:
                self._wheels.set_normal(-a, -b, 1.0)
            elif not self._wheels.is_level:
                self._wheels.set_normal(*UP)
        if self._base.fresh:
            self._looks, self._unseen = self._looks + 1, self._unseen + self._period
            if self._looks >= LOOKS:
                self.kalman.right(self._unseen)
                self._looks, self._unseen = 0, 0.0
                if found:
                    self._look_at_ground()

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

    def _doubt(self, turn: float, period: float) -> None:
        """Find out which wheels slip, by their ways of the last moments: encoders are too coarse for one cycle."""
        tags, share = self._tags, period / (self._tags.slip_time + period)
        self._slow *= 1.0 - share
        np.multiply(self._told, share, out=self._speeds)
        self._slow += self._speeds
        tolerance = tags.slip * period + tags.slip_share * math.hypot(*self.consensus.motion.tolist())
        self.consensus.agree(self._slow, self._arms, turn, self._weights, tolerance)

    def _weigh(self) -> None:
        """Weigh the wheels: those that are lifted do not count, unless fewer than two would be left."""
        if self._tags.forces:
            np.copyto(self._weights, self._wheels.forces)
            self._weights *= self._weights > self._tags.touch
        else:
            np.logical_not(self.lifted, out=self._weights)
        if np.count_nonzero(self._weights) < 2:
            self._weights[:] = 1.0

    def _trusted(self) -> np.ndarray:
        """Weigh the wheels that are believed; those that touch now may be others, which then all count."""
        weights = self._weights * self.consensus.believed
        return weights if np.count_nonzero(weights) > 1 else self._weights

    def _tell(self) -> None:
        """Compute the way that each wheel measures, and its arm, without a turn about the vertical."""
        wheels = self._wheels
        motion_kernel.tell(
            wheels.jacobian,
            self._jacobian,
            wheels.arms,
            self._arms_before,
            self._step,
            self._base.turned,
            self._told,
            self._arms,
        )

    def _note_turn(self, turn: float, measured: float) -> None:
        """Note a turn, and how far it is from the one that the IMU measured in the same time [rad]."""
        self._pending += turn
        if self._base.fresh:
            self._offset += self._pending - measured
            self._pending = self._time = 0.0

    def _note_rest(self, measured: float, time: float, period: float) -> None:
        """Note for how long no joint has moved and the gyroscope has measured no more than its bias and its noise."""
        keep = AT_REST / (AT_REST + period)
        self._sway *= keep
        self._sway += (1.0 - keep) * self._step
        limit = self._tags.rest * period
        still = float(np.abs(self._step).max()) <= limit and float(np.abs(self._sway).max()) <= SWAYING * limit
        if time:
            still = still and self._explains(measured, time)
        self._rest = self._rest + period if still else 0.0

    def _explains(self, turn: float, time: float) -> bool:
        """Return whether bias and noise explain a turn that the gyroscope measures within a time [s]."""
        deviation = math.sqrt(self.kalman.bias_variance + self._gyroscope / time)
        return abs(turn / time - self.kalman.bias) <= LIKELY * deviation + UNKNOWN

    def _mean_height(self) -> float:
        """Return the height of the contacts above the base's origin, mean of the wheels that touch [m]."""
        return float(self._weights @ self._wheels.arms[:, 2]) / float(self._weights.sum())

    def _note_rises(self, period: float) -> None:
        """Note how far wheels have risen against the others, and which are lifted."""
        motion_kernel.rises(
            self.consensus.rest,
            self._arms,
            self._base.turned,
            self._weights,
            self._trusted(),
            self._wheels.normal,
            self._tags.clearance,
            1.0 - period / FORGET,
            self._slope,
            self._rise,
            self.lifted,
        )

    def _remember(self) -> None:
        self._before[:] = self._wheels.position
        self._jacobian[:] = self._wheels.jacobian
        self._arms_before[:] = self._wheels.arms

    def _move(self) -> None:
        """Compute the velocities of this moment."""
        wheels, weights = self._wheels, self._trusted()
        self.angular[:] = self._base.angular
        self.angular[2] -= self.kalman.bias
        if self.filter is not None:
            self.filter.step(self.angular)
        motion_kernel.move(wheels.jacobian, wheels.velocity, self.angular, wheels.arms, weights, self.velocity)
        if self.smoothing is not None:
            self._moving[:3], self._moving[3] = self.velocity, self.angular[2]
            self.smoothing.step(self._moving)
            self.velocity[:], self.angular[2] = self._moving[:3], self._moving[3]
