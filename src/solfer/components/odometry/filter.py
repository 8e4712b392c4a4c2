"""The method `filter`: pose of the base by an error-state Kalman filter of rolling wheels and an IMU."""

import math

import numpy as np

from solfer.components.odometry import filter_kernel
from solfer.components.odometry.consensus import COMPARED, WheelConsensus, turn_of
from solfer.components.odometry.height_map import HeightMap
from solfer.components.odometry.kalman import NO_SAMPLE, ImuSample, WheelInertialFilter
from solfer.components.odometry.measured_base import MeasuredBase, about_vertical
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels
from solfer.numerics.filters import LowPass
from solfer.points.contact.support_vertex import UP

ODOMETRY_FORGETTING_TIME = 2.0
"""Time in which a wheel's rise above the others is forgotten while it touches [s]."""

REST_TIME = 0.1
"""Time for which wheels and joints have to stand still before the gyroscope's bias is estimated at rest [s]."""

SWAYING = 0.05
"""Share of the speed of a robot at rest which its joints may have on average: one that has stopped still sways."""

GYROSCOPE_STD, UNKNOWN_BIAS_STD = 5.0, 2e-3
"""Standard deviations of a gyroscope's noise at rest, and how fast a robot at rest may sway besides [rad/s]."""

ENCODERS, ENCODER_STD = 2e-3, 1e-5
"""Standard deviation of a wheel's velocity by encoders, and the same of a robot at rest [m/s]."""

SLIP_SHARE, SKID = 0.008, 0.02
"""Standard deviation of a wheel's velocity as a share of it, and of its way where wheels alone measure the turn."""

GROUND_HEIGHT_STD = 0.005
"""Standard deviation of the height of level ground [m]."""

TILT_INTERVAL = 10
"""Measurements from one of the tilt by the ground to the next: grounds and IMUs err for longer."""

HEIGHT_SETTLING_TIME, RAISING = 0.005, 0.2
"""Time in which the base comes to the height of the map [s], and its largest speed [m/s]."""

SHAKES, SHAKING = 2.5e-3, 0.3
"""What samples of a gyroscope miss while legs move, as a share of the speed of their joints, and for how long [s]: the
base shakes in time with the commands."""

CRAWLING = 0.15
"""Speed below which encoders are too coarse to measure on which slopes wheels are [m/s]."""

QUIET, DEAF = 5e-4, 1.0
"""Velocity by which wheels differ that roll and do not slide [m/s], and the variance of a turn without a gyroscope
[rad^2/s^2]."""

SPREADING = 0.1
"""Time over which the spread of each wheel's innovations is estimated [s]."""


class FilteredOdometry:
    """The base's pose and its covariance by `WheelInertialFilter`.

    With the Jacobian J of the wheel's material at the contact i, the steps dq of the joints and the turn p of the base
    between two measurements, a wheel that rolls measures the base's way m_i = -(J_i dq + p x r_i), with J and the arm r
    as means of both, so that the error is of third order. Encoders count and not velocities: no noise adds up.

    Each measurement of the joints is one update: the IMU predicts, the wheels that are neither lifted nor slip correct,
    and the pose is integrated. Ground that rises less than `level` is level and measures the error of the IMU's tilt;
    elsewhere its normal is that of the plane through the contacts. The height is that of `HeightMap`.

    Args:
        wheels: The wheels.
        base: What the IMU measures.
        tags: Tags of the configuration.

    Attributes:
        kalman: The filter.
        consensus: Finds the wheels that roll.
        position: Position of the base's origin in the world, shape (3,) [m]; live.
        heading: Angle about the vertical from the world to the base's x axis [rad].
        velocity: Velocity of the base's origin in the heading frame, shape (3,) [m/s]; live.
        angular: Angular velocity of the base in the heading frame, without the gyroscope's bias, shape (3,) [rad/s];
            live.
        lifted: Which wheels are lifted, shape (k,).
        filter: Filter of the angular velocity that the IMU measures, three numbers, or None.
        smoothing: Filter of the velocity and of the turn's rate, four numbers, or None.
    """

    def __init__(self, wheels: Wheels, base: MeasuredBase, tags: OdometryTags):
        count = len(wheels)
        self._wheels = wheels
        self._base = base
        self._tags = tags
        self._level = math.tan(math.radians(tags.level))
        self._gyroscope = tags.gyro_noise**2
        self.kalman = WheelInertialFilter(
            count,
            tags.acceleration,
            tags.gyro_noise,
            bias=tags.gyro_bias,
            walk=tags.gyro_walk,
            radius=tags.radius_share,
            tilt=math.radians(tags.tilt_deviation),
        )
        self.consensus = WheelConsensus(count, tags.slip_time)
        self._map = HeightMap(np.array(wheels.radii))
        self.filter: LowPass | None = None
        self.smoothing: LowPass | None = None
        self.position, self.velocity, self.angular = np.zeros((3, 3))
        self.heading = 0.0
        self.lifted = np.zeros(count, dtype=bool)
        # of each wheel: its rise, its weight if it touches, and if it also rolls, and the spread of its innovations
        self._rise, self._weights, self._trusted, self._spreads, self._variances = np.zeros((5, count))
        self._displacements, self._speeds, self._arms, self._arms_before = np.zeros((4, count, 3))
        self._jacobian_before = np.zeros_like(wheels.jacobian)
        self._step, self._joints_before, self._sway = np.zeros((3, wheels.joints))
        self._arm, self._tilting, self._rate, self._rate_before = np.zeros((4, 3))
        self._smoothed = np.zeros(4)
        self._slope, self._assumed = np.zeros((2, 2))
        self._offset = self._pending = self._since_imu = self._rest = self._since_look = 0.0
        self._looks = 0
        self._period = 1.0
        self._floor = math.nan
        self._floor_variance = 0.0

    def take(self, tags: OdometryTags) -> None:
        """Go on with the numbers of other tags by which wheels and ground are judged."""
        self._tags = tags

    def start(self) -> None:
        """Begin above the origin, with the heading of the IMU, on level ground; the pose is known then."""
        base = self._base
        wheels = self._wheels
        kalman = self.kalman
        for low_pass in (self.filter, self.smoothing):
            if low_pass is not None:
                low_pass.reset()
        kalman.start()
        self.consensus.start()
        base.start()
        wheels.set_normal(*UP)
        wheels.update(base.heading)
        self.heading = base.heading
        self._offset = self._pending = self._since_imu = self._rest = self._since_look = 0.0
        self._looks = 0
        self.lifted[:] = False
        for numbers in (self._rise, self._sway, self._spreads, self._assumed):
            numbers[:] = 0.0
        self._weigh()
        self._trusted[:] = self._weights
        filter_kernel.turn_rotation(base.rotation, -base.heading, kalman.axes)
        self._rate_before[:] = base.angular
        self._map.start(0.0 if wheels.is_level else math.nan)
        self._floor = self._map.floor
        self._floor_variance = 0.0
        self._look_at_ground()
        base.subtract_tilt(*kalman.tilt.tolist())
        wheels.subtract_tilt(*kalman.tilt.tolist())
        self.position[:] = 0.0, 0.0, -self._mean_height()
        base.angular[:2] = 0.0
        self._remember()
        self._find_velocity()

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the base somewhere else on the ground [m], with another heading [rad]; the pose is known then."""
        self.kalman.place()
        self._map.forget()
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
        self._period = period
        np.subtract(self._wheels.position, self._joints_before, out=self._step)
        keep = REST_TIME / (REST_TIME + period)
        moved, legs, sway = filter_kernel.joint_motion(self._step, self._wheels.legs, self._sway, keep)
        shaken, sample = self._follow_imu(legs / period)
        self._weigh()
        self._measure_displacements()
        turn, imu_time, unknown = self._measure_turn()
        self._note_rest(moved, sway, imu_time)
        self.kalman.predict(
            turn - self.kalman.bias * imu_time,
            period,
            moved * self._wheels.radii[0],
            shaken,
            arm=self._arm,
            heading=self.heading,
            sample=sample,
        )
        self._correct(turn, imu_time, legs / period)
        self._integrate(turn, imu_time, unknown)
        self._find_ground()
        self._remember()
        self._find_velocity()
        if measured:
            self._base.subtract_tilt(*self.kalman.tilt.tolist())

    def write_covariance(self, pose: np.ndarray, twist: np.ndarray) -> None:
        """Write the covariances of the pose, in world axes, and of the twist, in the heading frame.

        Args:
            pose: Of position and turns, shape (6, 6) [m, rad].
            twist: Of velocity and angular velocity, shape (6, 6) [m/s, rad/s].
        """
        self.kalman.write_covariances(self.heading, self._arm, self._period, pose, twist)

    def _follow_imu(self, leg_speed: float) -> tuple[float, ImuSample]:
        """Follow the tilt by a sample of the IMU, and turn the wheels by its error.

        Without a sample the base is assumed to tilt on as it did; the next sample measures the difference to that.

        Returns:
            Variance of what the gyroscope misses [rad^2/s^2], and the sample; none at rest.
        """
        base = self._base
        kalman = self.kalman
        if not base.fresh:
            np.multiply(base.angular[:2], self._period, out=base.turned[:2])
            self._assumed += base.turned[:2]
            return 0.0, NO_SAMPLE
        time = self._since_imu + self._period
        shaken = filter_kernel.mean_rate(
            base.rotation, base.heading, base.angular, base.turned, time, base.averages,
            self._rate_before, self._rate, kalman.axes,
        )  # fmt: skip
        shaken += (SHAKES * leg_speed) ** 2 * 2.0 * SHAKING / self._period
        sample = NO_SAMPLE
        x, y, _ = base.turned.tolist()
        before_x, before_y = kalman.tilt.tolist()
        if self._rest > REST_TIME:  # a robot at rest does not turn
            kalman.lean(0.0, x, y)
            kalman.rest(self._rate @ kalman.axes, time)
            base.turned[:2] = 0.0
        else:
            rate_x, rate_y, rate_z = (self._rate - kalman.biases).tolist()
            sample = ImuSample(rate_z * time, time)
            kalman.lean(sample.turn, x - rate_x * time, y - rate_y * time)
            tilt_x, tilt_y = kalman.tilt.tolist()
            base.turned[:2] = x - (tilt_x - before_x), y - (tilt_y - before_y)
        base.angular[0] = base.turned[0] / time
        base.angular[1] = base.turned[1] / time
        base.turned[:2] -= self._assumed
        self._assumed[:] = 0.0
        self._wheels.subtract_tilt(*kalman.tilt.tolist())
        return shaken, sample

    def _weigh(self) -> None:
        """Weigh the wheels: those that are lifted do not count, unless fewer than two would be left."""
        if self._tags.forces:
            np.copyto(self._weights, self._wheels.forces)
            self._weights *= self._weights > self._tags.touch
        else:
            np.logical_not(self.lifted, out=self._weights)
        if np.count_nonzero(self._weights) < 2:
            self._weights[:] = 1.0

    def _measure_displacements(self) -> None:
        """Compute displacements by the wheels without a turn about the vertical, and that of the base's tilting."""
        wheels = self._wheels
        filter_kernel.measure_displacements(
            wheels.jacobian, self._jacobian_before, wheels.arms, self._arms_before, self._step, self._base.turned,
            self._weights, self._displacements, self._arms, self._arm, self._tilting,
        )  # fmt: skip

    def _measure_turn(self) -> tuple[float, float, float]:
        """Return the turn about the vertical [rad], the time that the gyroscope measures [s], and a variance [rad^2].

        Without a sample of the gyroscope the turn is that of the wheels, and that is its variance.
        """
        self._since_imu += self._period
        if self._base.fresh:
            return float(self._rate[2]) * self._since_imu - self._pending, self._since_imu, 0.0
        turn, spread = turn_of(self._displacements, self._arms, self._trusted)
        deviation = SKID * float(np.abs(self._displacements).max()) + 1e-6
        wheels = float(self._trusted.sum() / self._trusted.max())
        return turn, 0.0, deviation * deviation / max(wheels * spread, 1e-9)

    def _note_rest(self, moved: float, sway: float, imu_time: float) -> None:
        """Note for how long no joint has moved and the gyroscope has measured no more than its bias and its noise."""
        limit = self._tags.rest * self._period
        still = moved <= limit and sway <= SWAYING * limit
        if still and imu_time:
            deviation = math.sqrt(self.kalman.bias_variance + self._gyroscope / imu_time)
            still = abs(float(self._rate[2]) - self.kalman.bias) <= GYROSCOPE_STD * deviation + UNKNOWN_BIAS_STD
        self._rest = self._rest + self._period if still else 0.0

    def _correct(self, turn: float, imu_time: float, leg_speed: float) -> None:
        """Correct the filter by the wheels that roll."""
        kalman = self.kalman
        consensus = self.consensus
        tags = self._tags
        period = self._period
        x, y, _ = kalman.velocity.tolist()
        speed = math.hypot(x, y)
        least = ENCODER_STD if self._rest > REST_TIME else ENCODERS
        filter_kernel.measure_speeds(
            self._displacements, self._tilting, period, SLIP_SHARE, least, self._spreads, self._variances, self._speeds
        )
        rate = turn / period
        share = imu_time / period
        expected = rate - share * kalman.bias
        tolerance = tags.slip + tags.slip_share * speed
        consensus.reject(self._speeds, self._arms, expected, self._weights, tolerance=tolerance, time=period)
        shakes = SHAKES * leg_speed
        variance = self._gyroscope / COMPARED + kalman.bias_variance + shakes * shakes if imu_time else DEAF
        contradiction = consensus.compare(
            self._speeds, self._arms, expected, variance,
            tolerance=self._tolerance(speed), time=period, variances=self._variances,
        )  # fmt: skip
        kalman.allow_scrubbing(contradiction)
        kalman.correct(self._speeds, self._arms, rate, share, variances=self._variances, inliers=consensus.inliers)
        filter_kernel.learn_spreads(
            self._speeds, self._arms, kalman.velocity, rate - share * (kalman.bias + kalman.noise),
            consensus.inliers, SPREADING / (SPREADING + period), self._weights, self._spreads, self._trusted,
        )  # fmt: skip

    def _tolerance(self, speed: float) -> float:
        """Return the variance by which wheels differ that roll [m^2/s^2]: encoders, radii, and slopes."""
        # wheels on slopes that differ by an angle go up by its sine, and by 1 - cosine less ahead
        sloped = 0.0 if self._map.level else 1.5 * float(self._spreads.max()) / max(speed, CRAWLING)
        return QUIET * QUIET + (self._tags.radius_share * speed) ** 2 + sloped * sloped

    def _integrate(self, measured: float, imu_time: float, unknown: float) -> None:
        """Integrate the pose, in the middle of the turn, and come to the height of the map."""
        kalman = self.kalman
        base = self._base
        wheels = self._wheels
        period = self._period
        turn = measured - (kalman.bias + kalman.noise) * imu_time
        kalman.integrate(self.heading + 0.5 * turn, period, imu_time, unknown)
        self._settle_floor()
        self.position += kalman.correction[:3]
        turn += float(kalman.correction[3])
        kalman.correction[:] = 0.0
        self._pending += turn
        if base.fresh:
            self._offset += self._pending - float(base.turned[2])
            self._pending = self._since_imu = 0.0
        displacement = kalman.velocity * period - self._tilting
        self.position += about_vertical(displacement, self.heading + 0.5 * turn)
        self.heading = base.heading + self._offset if base.fresh else self.heading + turn
        missing = self._map.missing_height(
            wheels.arms,
            wheels.normal,
            self.position,
            heading=self.heading,
            weights=self._trusted,
            velocity=kalman.velocity,
            turn=turn / period,
        )
        most = RAISING * period
        raised = (
            0.0 if math.isnan(missing) else min(max(missing * period / (HEIGHT_SETTLING_TIME + period), -most), most)
        )
        self.position[2] += raised
        self._map.note(raised, self._trusted)
        filter_kernel.find_lifted(
            self._displacements, self._arms, turn, base.turned, self._weights, self._trusted, wheels.normal,
            self._tags.clearance, 1.0 - period / ODOMETRY_FORGETTING_TIME, self._slope, self._rise, self.lifted,
        )  # fmt: skip

    def _settle_floor(self) -> None:
        """Measure the height on a floor as well as the floor's height was known first."""
        variance = float(self.kalman.covariance[2, 2])
        if not self._map.level:
            return
        if self._map.floor != self._floor:
            self._floor = self._map.floor
            self._floor_variance = variance
        if variance > self._floor_variance + GROUND_HEIGHT_STD * GROUND_HEIGHT_STD:
            self.kalman.settle_height(GROUND_HEIGHT_STD * math.sqrt(self._tags.settle / self._period))

    def _find_ground(self) -> None:
        """Find the normal of the ground; level ground measures the error of the tilt."""
        wheels = self._wheels
        found = bool(self._level) and filter_kernel.plane(self._weights, wheels.arms, self._slope)
        if found:
            a, b = self._slope.tolist()
            if math.hypot(a, b) > self._level * (1.0 if wheels.is_level else 0.7):
                wheels.set_normal(-a, -b, 1.0)
            elif not wheels.is_level:
                wheels.set_normal(*UP)
        if not self._base.fresh:
            return
        self._looks += 1
        self._since_look += self._period
        if self._looks >= TILT_INTERVAL:
            self.kalman.settle_tilt(self._since_look)
            self._looks = 0
            self._since_look = 0.0
            if found:
                self._look_at_ground()

    def _look_at_ground(self) -> bool:
        """Measure the tilt by the plane through the contacts, if that can be level; return whether it was."""
        if not (self._map.level and filter_kernel.plane(self._weights, self._wheels.arms, self._slope)):
            return False
        x, y = self.kalman.tilt.tolist()
        a, b = self._slope.tolist()
        return self.kalman.level(x + b, y - a)

    def _mean_height(self) -> float:
        """Return the height of the contacts above the base's origin, mean of the wheels that touch [m]."""
        return float(self._weights @ self._wheels.arms[:, 2]) / float(self._weights.sum())

    def _remember(self) -> None:
        self._joints_before[:] = self._wheels.position
        self._jacobian_before[:] = self._wheels.jacobian
        self._arms_before[:] = self._wheels.arms

    def _find_velocity(self) -> None:
        """Compute the velocities of this moment."""
        wheels = self._wheels
        self.angular[:] = self._base.angular
        self.angular[2] -= self.kalman.bias
        if self.filter is not None:
            self.filter.step(self.angular)
        filter_kernel.velocity_of_base(
            wheels.jacobian, wheels.velocity, self.angular, wheels.arms, self._trusted, self.velocity
        )
        if self.smoothing is not None:
            self._smoothed[:3] = self.velocity
            self._smoothed[3] = self.angular[2]
            self.smoothing.step(self._smoothed)
            self.velocity[:] = self._smoothed[:3]
            self.angular[2] = self._smoothed[3]
