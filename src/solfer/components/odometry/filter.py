"""The method `filter`: pose of the base by an error-state Kalman filter of rolling wheels and an IMU."""

import math

import numpy as np

from solfer.components.odometry import filter_kernel
from solfer.components.odometry.common_slip import CommonSlip
from solfer.components.odometry.consensus import COMPARISON_TIME, WheelConsensus, yaw_of
from solfer.components.odometry.feet import Feet
from solfer.components.odometry.ground.ground_plane import GroundPlane
from solfer.components.odometry.kalman import HEADING, NO_SAMPLE, TILT, ImuSample, WheelInertialFilter
from solfer.components.odometry.sensing.measured_base import MeasuredBase, about_vertical
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheel_motion import WheelMotion
from solfer.components.odometry.wheels import Wheels
from solfer.numerics.filters import LowPass
from solfer.points.contact.support_vertex import UP

REST_TIME = 0.1
"""Time for which wheels and joints have to stand still before the gyroscope's bias is estimated at rest [s]."""

SHAKE_RATIO = 2.5e-3
"""What samples of a gyroscope miss while legs move, as a ratio to the speed of their joints: the base shakes in time
with the commands."""


FOOT_SLIP = 3e-3
"""Standard deviation of the velocity of a foot that stands [m/s], as a ratio to the speed of the joints of legs."""

FOOT_TWIST = 0.05
"""That of the yaw rate by which feet twist on the ground [rad/s], as a ratio to the same."""

FOOT_SHARE = 0.014
"""That of what a foot slips on average, and of what its sole gives way, as a share of the way."""

STEP = 0.04
"""Height from the floor at which a foot stands elsewhere [m], and the time after which there is no floor [s]."""
STEP_TIME = 0.1

SLIP_DEVIATION = 0.03
"""Standard deviation of the velocity where all wheels begin to slip [m/s]."""


class ImuProgress:
    """How far an IMU has measured the base, and what was assumed since then.

    Args:
        joints: Number n of joints.

    Attributes:
        rate, rate_before: Mean angular velocity of its newest interval, and that at its begin, shape (3,) [rad/s].
        rates: Both, shape (2, 3).
        assumed: Tilting that was assumed since its last sample, shape (2,) [rad].
        since: Time since its last sample [s].
        pending: Yaw that was integrated since its last sample [rad].
        offset: From the heading of the IMU to that of the base [rad].
        period: Time since the measurement of the joints before [s].
        rest: Time for which the robot has stood still [s].
        sway: Mean motion of each joint, shape (n,).
        swing: Velocity of the IMU by the rotation of the base in the heading frame, shape (3,) [m/s].
    """

    def __init__(self, joints: int):
        self.rates = np.zeros((2, 3))
        self.rate, self.rate_before = self.rates
        self.assumed = np.zeros(2)
        self.swing = np.zeros(3)
        self.sway = np.zeros(joints)
        self.period = 1.0
        self.start()

    def start(self) -> None:
        """Begin with the heading of the IMU."""
        self.offset = self.pending = self.since = self.rest = 0.0
        self.sway[:] = self.swing[:] = 0.0
        self.assumed[:] = 0.0


class VelocitySpread:
    """How far the velocities of the base that single wheels measure are from their mean, which is published.

    Args:
        count: Number of wheels k.

    Attributes:
        each: Velocity of the base's origin by each wheel in the heading frame, shape (k, 3) [m/s].
        covariance: Covariance of their mean, shape (3, 3) [m^2/s^2].
        smoothed: Mean and yaw rate after a low-pass filter, shape (4,) [m/s, rad/s].
    """

    def __init__(self, count: int):
        self.each = np.zeros((count, 3))
        self.covariance = np.zeros((3, 3))
        self.smoothed = np.zeros(4)


class FilteredOdometry:
    """The base's pose and its covariance by `WheelInertialFilter`.

    With the Jacobian J of the wheel's material at the contact i, the steps dq of the joints and the rotation p of the
    base between two measurements, a wheel that rolls measures the displacement m_i = -(J_i dq + p x r_i) of the base,
    with J and the arm r as means of both, so that the error is of third order. Encoders count and not velocities: no
    noise adds up.

    Each measurement of the joints is one update: the IMU predicts, the wheels that are neither lifted nor slip correct,
    and the pose is integrated. Ground that rises less than `level` is level and measures the error of the IMU's tilt;
    elsewhere its normal is that of the plane through the contacts. The height is that of `HeightMap`.

    Feet that lift and land are contacts like wheels, with four differences. Those that stand count (`Feet`), each by
    its probability alone, and none has to. The velocity is that of the base's origin, and between feet the
    accelerometer predicts it, with the error of the tilt. On a floor each foot that stands measures the height; where
    feet stand elsewhere there is no floor, and the height follows the velocity. What lands measures from where it is.

    Args:
        wheels: The wheels or feet.
        base: What the IMU measures.
        tags: Tags of the configuration.

    Attributes:
        kalman: The filter.
        consensus: Finds the wheels that roll.
        slip: Finds out whether all of them slip.
        ground: The ground below them.
        position: Position of the base's origin in the world, shape (3,) [m]; live.
        heading: Angle about the vertical from the world to the base's x axis [rad].
        velocity: Velocity of the base's origin in the heading frame, shape (3,) [m/s]; live.
        angular: Angular velocity of the base in the heading frame, without the gyroscope's bias, shape (3,) [rad/s];
            live.
        filter: Filter of the angular velocity that the IMU measures, three numbers, or None.
        smoothing: Filter of the velocity and of the yaw rate, four numbers, or None.
    """

    def __init__(self, wheels: Wheels, base: MeasuredBase, tags: OdometryTags):
        count = len(wheels)
        self._base = base
        base.shakes = wheels.steps
        self._tags = tags
        self.kalman = WheelInertialFilter(
            count,
            tags.acceleration,
            tags.gyro_noise,
            bias=tags.gyro_bias,
            walk=tags.gyro_walk,
            radius=FOOT_SHARE if wheels.steps else tags.radius_share,
            tilt=math.radians(tags.tilt_deviation),
        )
        self.consensus = WheelConsensus(count, tags.slip_time)
        self._motion = WheelMotion(wheels)
        self.ground = GroundPlane(self._motion, self.kalman, math.tan(math.radians(tags.level)))
        self.slip = CommonSlip(self._motion, self.ground.slope)
        self._imu = ImuProgress(wheels.joints)
        self.filter: LowPass | None = None
        self.smoothing: LowPass | None = None
        self.position, self.velocity, self.angular = np.zeros((3, 3))
        self.heading = 0.0
        self._spread = VelocitySpread(count)

    @property
    def lifted(self) -> np.ndarray:
        """Which wheels are lifted, shape (k,); live."""
        return self.ground.lifted

    @property
    def feet(self) -> Feet | None:
        """Which contacts stand, if they are feet; None: they are wheels."""
        return self._motion.feet

    def take(self, tags: OdometryTags) -> None:
        """Go on with the numbers of other tags by which wheels and ground are classified."""
        self._tags = tags

    def start(self) -> None:
        """Begin above the origin, with the heading of the IMU, on level ground; the pose is known then."""
        base = self._base
        motion = self._motion
        wheels = motion.wheels
        kalman = self.kalman
        for low_pass in (self.filter, self.smoothing):
            if low_pass is not None:
                low_pass.reset()
        kalman.start()
        self.consensus.start()
        self.slip.start()
        base.start()
        wheels.set_normal(*UP)
        wheels.update(base.heading)
        self.heading = base.heading
        self._imu.start()
        self.ground.start()
        motion.spreads[:] = 0.0
        if motion.feet is not None:
            motion.feet.start()
        self._spread.covariance[:] = 0.0
        self._weigh()
        motion.trusted[:] = motion.weights
        filter_kernel.turn_rotation(base.rotation, -base.heading, kalman.axes)
        self._imu.rate_before[:] = base.angular
        self.ground.start_map()
        base.subtract_tilt(*kalman.tilt.tolist())
        filter_kernel.subtract_tilt(wheels.arms, wheels.jacobian, *kalman.tilt.tolist())
        self.position[:] = 0.0, 0.0, -motion.mean_height()
        base.angular[:2] = 0.0
        self._motion.remember()
        self._find_velocity()

    def resume(self) -> None:
        """Begin again at the last place and heading: nothing is known of the time since the last measurement."""
        stop_time = 1.0  # [s] in which a robot whose commands are not received comes to rest
        x, y, z = self.position.tolist()
        speeds = (*self.velocity[:2].tolist(), float(self.angular[2]))
        heading = self.heading
        ground = z + self._motion.mean_height()
        variances = [
            float(self.kalman.covariance[axis, axis]) + (stop_time * speed) ** 2
            for axis, speed in zip((0, 1, HEADING), speeds, strict=True)
        ]
        self.start()
        self.place(x, y, heading)
        self.position[2] += ground
        self.kalman.place(*variances)

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the base somewhere else on the ground [m], with another heading [rad]; the pose is known then."""
        self.kalman.place()
        self.ground.map.forget()
        self.position[:2] = x, y
        self._imu.offset += heading - self.heading
        self.heading = heading

    def update(self, period: float, measured: bool) -> None:
        """Follow a measurement of the joints.

        Args:
            period: Time since the one before [s].
            measured: Whether the IMU has measured the base since then.
        """
        motion = self._motion
        self._base.read(measured)
        motion.wheels.update(self._base.heading)
        self._imu.period = period
        moved, legs, sway = motion.find_step(self._imu.sway, REST_TIME / (REST_TIME + period))
        shaken, sample = self._follow_imu(legs / period)
        if motion.feet is not None:
            self._push()
        self._weigh()
        filter_kernel.measure_displacements(motion.block.address, self._base.turned)
        yaw, imu_time, unknown = self._measure_yaw()
        self._note_rest(moved, sway, imu_time)
        self.kalman.predict(
            yaw - self.kalman.bias * imu_time,
            period,
            moved * motion.wheels.radii[0],
            shaken,
            arm=motion.arm,
            heading=self.heading,
            sample=sample,
        )
        if motion.feet is None:
            self._correct(yaw, imu_time, legs / period)
        else:
            self._stand(yaw, imu_time, legs / period, feet=motion.feet)
        self._integrate(yaw, imu_time, unknown)
        self.ground.update(self._base.fresh, period, self.heading, angular=self.angular)
        motion.remember()
        self._find_velocity()
        if measured:
            self._base.subtract_tilt(*self.kalman.tilt.tolist())

    def stop_tilting(self) -> None:
        """Assume that the base does not tilt, until the IMU measures it again."""
        self._base.angular[:2] = 0.0

    def write_covariance(self, pose: np.ndarray, twist: np.ndarray) -> None:
        """Write the covariances of the pose, in world axes, and of the twist, in the heading frame.

        Args:
            pose: Of position and rotations, shape (6, 6) [m, rad].
            twist: Of velocity and angular velocity, shape (6, 6) [m/s, rad/s].
        """
        slips = bool(self.slip.lasts) or self._motion.feet is not None  # then the velocity is that of the filter
        known = self.kalman.velocity_covariance if slips else self._spread.covariance
        self.kalman.write_covariances(self.heading, self._motion.arm, self._imu.period, known, pose=pose, twist=twist)

    def _follow_imu(self, leg_speed: float) -> tuple[float, ImuSample]:
        """Follow the tilt by a sample of the IMU, and turn the wheels by its error.

        Without a sample the base is assumed to tilt on as it did, slower and slower from 0.02 s on; the next sample
        measures the difference to that.

        Returns:
            Variance of what the gyroscope misses [rad^2/s^2], and the sample; none at rest.
        """
        imu = self._imu
        base = self._base
        kalman = self.kalman
        if not base.fresh:
            if imu.since > 0.02:  # [s]
                base.angular[:2] *= 0.02 / (0.02 + imu.period)  # time constant [s]
            np.multiply(base.angular[:2], self._imu.period, out=base.turned[:2])
            imu.assumed += base.turned[:2]
            return 0.0, NO_SAMPLE
        time = imu.since + self._imu.period
        shaken = filter_kernel.mean_rate(
            base.rotation, base.heading, base.angular, base.turned, time, base.averages,
            imu.rates, kalman.axes,
        )  # fmt: skip
        shaking_time = 0.3  # [s] for which it lasts
        if self._motion.feet is None:
            shaken += (SHAKE_RATIO * leg_speed) ** 2 * 2.0 * shaking_time / self._imu.period
        elif base.averages:  # a walk shakes so evenly that the mean of its samples misses nothing
            shaken = 0.0
        sample = NO_SAMPLE
        x, y, _ = base.turned.tolist()
        before_x, before_y = kalman.tilt.tolist()
        if imu.rest > REST_TIME:  # a robot at rest does not turn
            kalman.follow_tilt(0.0, x, y)
            # wheels measure the bias about z, feet twist
            kalman.rest((imu.rate @ kalman.axes)[: 2 if self._motion.feet is None else 3], time)
            base.turned[:2] = 0.0
        else:
            rate_x, rate_y, rate_z = (imu.rate - kalman.biases).tolist()
            sample = ImuSample(rate_z * time, time)
            kalman.follow_tilt(sample.yaw, x - rate_x * time, y - rate_y * time)
            tilt_x, tilt_y = kalman.tilt.tolist()
            base.turned[:2] = x - (tilt_x - before_x), y - (tilt_y - before_y)
        base.angular[0] = base.turned[0] / time
        base.angular[1] = base.turned[1] / time
        base.turned[:2] -= imu.assumed
        imu.assumed[:] = 0.0
        wheels = self._motion.wheels
        filter_kernel.subtract_tilt(wheels.arms, wheels.jacobian, *kalman.tilt.tolist())
        return shaken, sample

    def _push(self) -> None:
        """Let the velocity follow what the accelerometer has measured since it was read the last time."""
        base = self._base
        imu = self._imu
        kalman = self.kalman
        if not base.fresh:
            kalman.pushed[:] = 0.0
            return
        change, place = base.velocity_change
        swing = np.cross(base.angular, kalman.axes @ place)
        kalman.push(about_vertical(change, -base.heading) - swing + imu.swing, imu.since + imu.period)
        imu.swing[:] = swing

    def _stand(self, yaw: float, imu_time: float, leg_speed: float, feet: Feet) -> None:
        """Correct the filter by the feet that stand."""
        motion = self._motion
        kalman = self.kalman
        ground = self.ground
        inliers = self.consensus.inliers
        period = self._imu.period
        deviation = 1e-3 + FOOT_SLIP * leg_speed  # [m/s]
        filter_kernel.measure_speeds(
            motion.displacements, motion.tilting, period, 0.0, deviation, motion.spreads, motion.variances,
            motion.speeds,
        )  # fmt: skip
        kalman.allow_scrubbing((FOOT_TWIST * leg_speed) ** 2)
        np.greater(motion.weights, 0.0, out=inliers)
        np.logical_not(inliers, out=ground.lifted)
        floor = ground.map.floor
        kalman.correct(
            motion.speeds,
            motion.arms,
            yaw / period,
            imu_time / period,
            variances=motion.variances,
            inliers=inliers,
            height=float(self.position[2]) - floor,
        )
        np.multiply(motion.weights, inliers, out=motion.trusted)
        feet.coasted = 0.0 if inliers.any() else feet.coasted + period
        off = np.abs(motion.wheels.arms[:, 2] + float(self.position[2]) - floor)[inliers]
        feet.uneven = feet.uneven + period if (off > STEP).any() else 0.0
        if feet.uneven > STEP_TIME:
            ground.map.start(math.nan)

    def _weigh(self) -> None:
        motion = self._motion
        tags = self._tags
        if motion.feet is None:
            motion.weigh(self.ground.lifted, tags.touch if tags.forces else None)
        else:
            motion.feet.weigh(motion.wheels.forces if tags.forces else None, tags.touch, self._imu.period)

    def _measure_yaw(self) -> tuple[float, float, float]:
        """Return the yaw [rad], the time that the gyroscope measures [s], and a variance [rad^2].

        Without a sample of the gyroscope the yaw is that of the wheels, and that is its variance.
        """
        imu = self._imu
        motion = self._motion
        imu.since += self._imu.period
        if self._base.fresh:
            return float(imu.rate[2]) * imu.since - imu.pending, imu.since, 0.0
        if motion.feet is not None:  # as many as stand: it turns on
            return float(imu.rate[2]) * imu.period, 0.0, (0.5 * imu.period) ** 2  # at up to 0.5 rad/s else
        yaw, spread = yaw_of(motion.displacements, motion.arms, motion.trusted)
        # 2 % of the largest displacement
        deviation = 0.02 * float(np.abs(motion.displacements).max()) + 1e-6
        wheels = float(motion.trusted.sum() / motion.trusted.max())
        return yaw, 0.0, deviation * deviation / max(wheels * spread, 1e-9)

    def _note_rest(self, moved: float, sway: float, imu_time: float) -> None:
        """Note for how long no joint has moved and the gyroscope has measured no more than its bias and its noise."""
        imu = self._imu
        limit = self._tags.rest * self._imu.period
        still = moved <= limit and sway <= 0.05 * limit  # a robot that has stopped still sways
        if still and imu_time:
            deviation = math.sqrt(self.kalman.bias_variance + self._tags.gyro_noise**2 / imu_time)
            # five standard deviations of its noise, and 2 mrad/s by which a robot at rest may sway
            still = abs(float(imu.rate[2]) - self.kalman.bias) <= 5.0 * deviation + 2e-3
        imu.rest = imu.rest + self._imu.period if still else 0.0

    def _correct(self, yaw: float, imu_time: float, leg_speed: float) -> None:
        """Correct the filter by the wheels that roll, or by the accelerometer where all slip."""
        motion = self._motion
        kalman = self.kalman
        consensus = self.consensus
        tags = self._tags
        period = self._imu.period
        x, y, _ = kalman.velocity.tolist()
        speed = math.hypot(x, y)
        encoder_deviation = 1e-5 if self._imu.rest > REST_TIME else 2e-3  # [m/s] of a wheel's velocity
        filter_kernel.measure_speeds(
            motion.displacements,
            motion.tilting,
            period,
            0.008,  # deviation of a wheel's velocity by slip, as a ratio to it
            encoder_deviation,
            motion.spreads,
            motion.variances,
            motion.speeds,
        )
        rate = yaw / period
        covered = imu_time / period
        bias = kalman.bias
        expected = rate - covered * bias
        tolerance = tags.slip + tags.slip_share * speed
        consensus.reject(motion.speeds, motion.arms, expected, motion.weights, tolerance=tolerance, time=period)
        shakes = SHAKE_RATIO * leg_speed
        variance = 1.0  # [rad^2/s^2] without a gyroscope
        if imu_time:
            variance = self._tags.gyro_noise**2 / COMPARISON_TIME + kalman.bias_variance + shakes * shakes
        contradiction = consensus.compare(
            motion.speeds, motion.arms, expected, variance,
            tolerance=self._tolerance(speed), time=period, variances=motion.variances,
        )  # fmt: skip
        kalman.allow_scrubbing(contradiction)
        if imu_time:
            self._compare(imu_time, bias)
        if self.slip.lasts:
            kalman.coast(self.slip.speed - self.slip.slip, self.slip.velocity_variance(period))
            consensus.inliers[:] = False
            return
        kalman.correct(
            motion.speeds,
            motion.arms,
            rate,
            covered,
            variances=motion.variances,
            inliers=consensus.inliers,
        )
        spread_time = 0.1  # [s] over which each wheel's innovations are averaged
        yaw_rate = rate - covered * kalman.excess
        keep = spread_time / (spread_time + period)
        filter_kernel.learn_spreads(motion.block.address, kalman.velocity, yaw_rate, consensus.inliers, keep)

    def _compare(self, time: float, bias: float) -> None:
        """Compare the wheels with the accelerometer, `time` [s] after it was read; where slip begins, go back.

        `bias` is that of the gyroscope about the vertical [rad/s].
        """
        base = self._base
        kalman = self.kalman
        x, y, z = base.angular.tolist()
        slipped = self.slip.follow(
            *base.velocity_change,
            kalman.axes,
            self.consensus.inliers,
            heading=base.heading,
            rotation=(x, y, z - bias, time),
            tilt=(*kalman.tilt.tolist(), float(kalman.covariance[TILT, TILT])),
        )
        if slipped is not None:
            kalman.lose_velocity(SLIP_DEVIATION**2)
            self.position[:2] -= about_vertical(np.append(slipped, 0.0), self.heading)[:2]

    def _tolerance(self, speed: float) -> float:
        """Return the variance by which wheels differ that roll [m^2/s^2]: encoders, radii, and slopes."""
        # wheels on slopes that differ by an angle go up by its sine, and by 1 - cosine less ahead; below 0.15 m/s
        # encoders are too coarse to measure that
        sloped = 0.0 if self.ground.map.level else 1.5 * float(self._motion.spreads.max()) / max(speed, 0.15)
        noise = 5e-4  # [m/s] by encoders
        return noise * noise + (self._tags.radius_share * speed) ** 2 + sloped * sloped

    def _integrate(self, measured: float, imu_time: float, unknown: float) -> None:
        """Integrate the pose, in the middle of the yaw; wheels come to the height of the map."""
        ground = self.ground
        imu = self._imu
        motion = self._motion
        wheels = motion.wheels
        kalman = self.kalman
        base = self._base
        period = self._imu.period
        yaw = measured - kalman.excess * imu_time
        kalman.integrate(self.heading + 0.5 * yaw, period, imu_time, unknown)
        if motion.feet is None:
            ground.settle(self._tags.settle, period)
        yaw = filter_kernel.move_base(
            self.position, kalman.correction, kalman.velocity, kalman.pushed, motion.tilting, self.heading, yaw, period
        )  # fmt: skip
        imu.pending += yaw
        if base.fresh:
            imu.offset += imu.pending - float(base.turned[2])
            imu.pending = imu.since = 0.0
        self.heading = base.heading + imu.offset if base.fresh else self.heading + yaw
        if motion.feet is not None:
            return
        missing = ground.map.missing_height(
            wheels.arms,
            wheels.ground.normal,
            self.position,
            heading=self.heading,
            weights=motion.trusted,
            velocity=kalman.velocity,
            yaw_rate=yaw / period,
        )
        settling_time = 0.005  # [s] in which the base comes to the height of the map
        largest = 0.2 * period  # [m] at 0.2 m/s
        raised = (
            0.0 if math.isnan(missing) else min(max(missing * period / (settling_time + period), -largest), largest)
        )
        self.position[2] += raised
        ground.map.note(raised, motion.trusted)
        forgetting_time = 2.0  # [s] in which a wheel's rise is forgotten while it touches
        forget = 1.0 - period / forgetting_time
        clearance = self._tags.clearance
        filter_kernel.find_lifted(
            motion.block.address, ground.block.address, yaw, base.turned, wheels.ground.normal, clearance, forget
        )

    def _find_velocity(self) -> None:
        """Compute the velocities of this moment."""
        wheels = self._motion.wheels
        self.angular[:] = self._base.angular
        self.angular[2] -= self.kalman.bias
        if self.filter is not None:
            self.filter.step(self.angular)
        if self._motion.feet is not None:
            self.velocity[:] = self.kalman.velocity
        else:
            spread_time = 0.1  # [s] over which wheels are compared
            filter_kernel.velocity_of_base(
                wheels.jacobian, wheels.velocity, self.angular, wheels.arms, self._motion.trusted, self.velocity,
                self._spread.each, spread_time / (spread_time + self._imu.period), self._spread.covariance,
            )  # fmt: skip
        if self.slip.lasts:
            self.velocity[:2] -= self.slip.slip
        if self.smoothing is not None:
            self._spread.smoothed[:3] = self.velocity
            self._spread.smoothed[3] = self.angular[2]
            self.smoothing.step(self._spread.smoothed)
            self.velocity[:] = self._spread.smoothed[:3]
            self.angular[2] = self._spread.smoothed[3]
