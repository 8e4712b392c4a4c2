"""The error-state Kalman filter of the base: wheels that roll, a gyroscope, and an IMU's tilt."""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from solfer.components.odometry import kalman_kernel as kernel
from solfer.components.odometry.kalman_kernel import GYRO_BIAS, HEADING, RADIUS, SCRUB, SLOPE, TILT, VELOCITY
from solfer.numerics.blocks import MemoryBlock

TILT_TIME_CONSTANT = 30.0
"""Time constant of the error of the tilt that an IMU measures [s]."""

FLOOR_DEVIATION = math.radians(0.2)
"""Standard deviation of a level floor from the plane under four wheels [rad] (DIN 18202: 4 mm within 1 m)."""

FLOOR_LENGTH = 0.1
"""Distance after which the floor is another one [m]."""

SCRUB_TIME = 1.0
"""Time constant of the yaw rate by which wheels scrub [s]."""

SHAKING = 0.45
"""Density of what samples of an accelerometer miss of the impacts of feet [m/s^2/sqrt(Hz)]."""

GRAVITY = 9.81
"""[m/s^2]"""

PLANE_DEVIATION = 3e-4
"""Standard deviation of the tilt of the plane through contacts, by encoders [rad]."""


class ImuSample(NamedTuple):
    """What a sample of the IMU measures of the tilt.

    Attributes:
        yaw: Yaw of H since the sample before, which `follow_tilt` has followed [rad].
        time: Time that the sample covers [s]; 0: there is none.
    """

    yaw: float = 0.0
    time: float = 0.0


NO_SAMPLE = ImuSample()


class FilterVariances(NamedTuple):
    """Squares of the deviations and densities that `WheelInertialFilter` is given, see there."""

    acceleration: float
    noise: float
    bias: float
    walk: float
    radius: float
    tilt: float


class WheelInertialFilter:
    """Pose, velocity and errors of the sensors of a base on wheels, with their covariance.

    Frames: the world W; the heading frame H, which is W turned about the vertical z by the heading; the base B. The
    velocity is that of the ground point: the point of the base at the mean of the contacts, `arm` from its origin.

    | state | index | frame | process |
    |---|---|---|---|
    | position p [m] | 0-2 | W | p' = R(heading) v |
    | heading [rad] | 3 | | heading' = u - b_z - n |
    | velocity v [m/s] | 4-6 | H | random walk |
    | bias of the gyroscope b [rad/s] | 7-9 | B | random walk |
    | its noise in this interval n [rad/s] | 10 | | white |
    | scrubbing c [rad/s] | 11 | | Gauss-Markov, in proportion to what wheels roll |
    | error of the IMU's tilt t [rad] | 12-13 | H | Gauss-Markov about 0 |
    | slope of the floor g [rad] | 14-15 | H | Gauss-Markov of the way |
    | ratio e by which each radius is too large | 16... | | constant |

    With the rate u of the gyroscope about the vertical, which covers the time s of an interval T, a wheel at r measures

        w = (1 - e) (v + (u s / T - (b_z + n) s / T + c) z x r)

    The plane through the contacts measures t + g. Position and heading of the state are corrections, which the one that
    integrates the pose takes over and sets to zero. Wheels do not correct the position, and nothing corrects the radii,
    whose common error is not observable: they are considered (Schmidt-Kalman). Source: M. Bloesch et al., "State
    estimation for legged robots", RSS 2012, with wheels that roll in place of feet that stand.

    Args:
        count: Number of wheels k.
        acceleration: Standard deviation of the change of the velocity [m/s^2].
        noise: Density of the gyroscope's white noise [rad/s/sqrt(Hz)].
        bias: Standard deviation of b at the start [rad/s].
        walk: Random walk of b [rad/s/sqrt(s)].
        radius: Standard deviation of e.
        tilt: Standard deviation of t [rad]; 0: t and g are not estimated.

    Attributes:
        covariance: Covariance P, shape (16 + k, 16 + k); live.
        state: State, shape (16 + k,); live.
        correction: Corrections of position and heading, shape (4,) [m, rad]; live.
        velocity: v, shape (3,) [m/s]; live.
        tilt: t, shape (2,) [rad]; live.
        axes: Rotation from B to H, shape (3, 3); live, to be written before each prediction.
        rolling: Probability that each wheel rolls and does not slip, shape (k,); live.
        innovations: Innovation of each wheel's velocity, shape (k, 3) [m/s]; live.
        slide: Variance of the position after a metre by wheels that slide [m^2/m].
        pushed: What an accelerometer measures in the interval, see `push`, shape (5,); live.
        write_covariances: Writes the covariances of the pose of the base's origin, in W, and of its twist, in H. Takes
            the heading [rad]; the `arm`, see `predict`; the interval for which the angular velocity is a mean [s]; the
            covariance of the velocity by the wheels in H, shape (3, 3) [m^2/s^2]; and where it writes those of position
            and rotations, shape (6, 6) [m, rad], and of velocity and angular velocity, shape (6, 6) [m/s, rad/s].
    """

    def __init__(
        self,
        count: int,
        acceleration: float,
        noise: float,
        bias: float,
        walk: float,
        *,
        radius: float,
        tilt: float = 0.0,
    ):
        size = RADIUS + count
        self._variances = FilterVariances(
            acceleration**2, noise**2, bias**2, walk=walk**2, radius=radius**2, tilt=tilt**2
        )
        self.covariance = np.zeros((size, size))
        self.state = np.zeros(size)
        self.correction = self.state[: HEADING + 1]
        self.velocity = self.state[VELOCITY:GYRO_BIAS]
        self.tilt = self.state[TILT:SLOPE]
        self.axes = np.eye(3)
        self._bias_of_base = self.state[GYRO_BIAS : GYRO_BIAS + 3]
        self.pushed = np.zeros(5)
        self.rolling = np.ones(count)
        self.innovations = np.zeros((count, 3))
        transition, noise_covariance, half = np.zeros((3, size, size))
        self._block = MemoryBlock(
            kernel.FILTER,
            size=size,
            count=count,
            covariance=self.covariance,
            state=self.state,
            axes=self.axes,
            rows=np.zeros((count, 3, size)),
            innovations=self.innovations,
            rolling=self.rolling,
            transition=transition,
            noise=noise_covariance,
            half=half,
            pushed=self.pushed,
        )
        self.write_covariances = partial(kernel.write_covariances, self._block.address, self._variances.noise)
        self._velocity_noise = 0.0
        self.start()

    def start(self) -> None:
        """Begin at rest, at a pose that is known but for its tilt."""
        self.state[:] = 0.0
        self.rolling[:] = 1.0
        self.pushed[:] = 0.0
        self.slide = 3e-3**2  # before slip that lasts is estimated
        given = self._variances
        variances = np.zeros(len(self.state))
        variances[VELOCITY:GYRO_BIAS] = 1e-3**2  # [m^2/s^2] of a robot at rest
        variances[GYRO_BIAS : GYRO_BIAS + 3] = given.bias
        variances[RADIUS:] = given.radius
        if given.tilt:
            variances[TILT:SLOPE] = given.tilt
            variances[SLOPE:RADIUS] = FLOOR_DEVIATION**2
        self.covariance[:] = np.diag(variances)

    def place(self, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> None:
        """Set position and heading to known values with variances [m^2, rad^2]."""
        self.covariance[: HEADING + 1] = 0.0
        self.covariance[:, : HEADING + 1] = 0.0
        self.covariance[0, 0] = x
        self.covariance[1, 1] = y
        self.covariance[HEADING, HEADING] = heading

    @property
    def biases(self) -> np.ndarray:
        """Bias of the gyroscope in H, shape (3,) [rad/s]; a new array."""
        return self.axes.dot(self._bias_of_base)

    @property
    def bias(self) -> float:
        """Bias of the gyroscope about the vertical [rad/s]."""
        return float(self.axes[2].dot(self._bias_of_base))

    @property
    def excess(self) -> float:
        """What the gyroscope measures too much about the vertical in this interval: bias and noise [rad/s]."""
        return float(self.axes[2].dot(self._bias_of_base)) + float(self.state[kernel.GYRO_NOISE])

    @property
    def bias_variance(self) -> float:
        """Variance of the bias about the base's z axis [rad^2/s^2]."""
        return float(self.covariance[GYRO_BIAS + 2, GYRO_BIAS + 2])

    def push(self, change: np.ndarray, time: float) -> None:
        """Let the next prediction change the velocity by what an accelerometer measures, and not walk at random.

        Args:
            change: Change of the velocity of the base's origin in H, shape (3,) [m/s]; NaN: nothing is known of it.
            time: Time of that [s].
        """
        if math.isnan(float(change.sum())):
            self.pushed[:] = 0.0
            return
        self.pushed[:3] = change
        self.pushed[3] = SHAKING**2 * time
        self.pushed[4] = GRAVITY * time

    def predict(
        self,
        yaw: float,
        period: float,
        rolled: float = 0.0,
        shaken: float = 0.0,
        *,
        arm: np.ndarray | None = None,
        heading: float = 0.0,
        sample: ImuSample = NO_SAMPLE,
    ) -> None:
        """Propagate velocity and errors of the sensors over an interval.

        Args:
            yaw: Yaw of H [rad].
            period: Length of the interval [s].
            rolled: Distance that wheels roll [m].
            shaken: Variance of what the gyroscope misses between its samples [rad^2/s^2].
            arm: From the base's origin to the mean of the contacts in H, shape (3,) [m]; None: straight above it.
            heading: Heading [rad].
            sample: Sample of the IMU in the interval.
        """
        tilt_yaw, imu_time = sample
        given = self._variances
        scrub = -math.expm1(-period / SCRUB_TIME)
        slope = -math.expm1(-rolled / FLOOR_LENGTH)
        estimates_tilt = given.tilt > 0.0 and imu_time > 0.0
        # scrubbing yaws the base by 0.5 mrad for each metre that wheels roll
        self._velocity_noise = given.acceleration * period * period
        variances = (
            self._velocity_noise,
            (5e-4 * rolled / period) ** 2 * scrub * (2.0 - scrub),
            given.noise / period + shaken,
            given.noise * imu_time + shaken * imu_time * imu_time,
            FLOOR_DEVIATION**2 * slope * (2.0 - slope) if estimates_tilt else 0.0,
        )
        kernel.predict(
            self._block.address,
            _ORIGIN if arm is None else arm,
            heading,
            (yaw, tilt_yaw),
            imu_time if estimates_tilt else 0.0,
            (1.0 - scrub, 1.0 - slope if estimates_tilt else 1.0),
            variances,
        )

    def follow_tilt(self, yaw: float, x: float, y: float) -> None:
        """Let the tilt's error follow what the IMU's orientation rotates more than its gyroscope.

        Args:
            yaw: Yaw of H [rad].
            x: That difference about the axis x of H [rad].
            y: The same about y [rad].
        """
        if not self._variances.tilt:
            return
        cosine = math.cos(yaw)
        sine = math.sin(yaw)
        a, b = self.tilt.tolist()
        self.tilt[0] = cosine * a + sine * b + x
        self.tilt[1] = cosine * b - sine * a + y

    def settle_tilt(self, time: float) -> None:
        """Measure that the IMU's tilt has no error, as well as it has none within a time [s]."""
        if self._variances.tilt:
            variance = 2.0 * TILT_TIME_CONSTANT / time * self._variances.tilt
            kernel.measure(self._block.address, TILT, _NO_TILT, variance)

    def rest(self, angular: np.ndarray, time: float) -> None:
        """Measure the bias about the base's first axes by the gyroscope at rest, in B, shape (2,) or (3,)."""
        kernel.measure(self._block.address, GYRO_BIAS, angular, self._variances.noise / time)

    def level(self, x: float, y: float) -> bool:
        """Measure the tilt by the plane through the contacts, which is turned about x and y of H by the IMU [rad].

        Returns:
            Whether it passes for level ground.
        """
        return not self._variances.tilt or bool(kernel.level(self._block.address, x, y, PLANE_DEVIATION**2))

    def allow_scrubbing(self, variance: float) -> None:
        """Let scrubbing have at least a variance [rad^2/s^2]."""
        self.covariance[SCRUB, SCRUB] = max(float(self.covariance[SCRUB, SCRUB]), variance)

    def correct(
        self,
        speeds: np.ndarray,
        arms: np.ndarray,
        rate: float,
        covered: float,
        *,
        variances: np.ndarray,
        inliers: np.ndarray,
        height: float | None = None,
    ) -> None:
        """Correct the state by the velocities that wheels measure.

        Args:
            speeds: w, in H, shape (k, 3) [m/s].
            arms: r, from the base's origin, in H, shape (k, 3) [m].
            rate: u s / T [rad/s].
            covered: s / T.
            variances: Variances of w, shape (k,) [m^2/s^2].
            inliers: Which wheels count, shape (k,); those that more likely slip are taken out.
            height: Of feet: the height of the base's origin above a floor [m]; NaN: there is none. None: these are
                wheels, two of which count in any case.
        """
        steps = height is not None
        kernel.correct(
            self._block.address, speeds, arms, rate, covered, variances, inliers, height if steps else math.nan, steps
        )

    def lose_velocity(self, variance: float) -> None:
        """Know the velocity by another measurement from now on, with a variance [m^2/s^2]."""
        for axis in range(VELOCITY, VELOCITY + 2):
            self.covariance[axis] = 0.0
            self.covariance[:, axis] = 0.0
            self.covariance[axis, axis] = variance
        self.rolling[:] = 0.0

    def coast(self, velocity: np.ndarray, variance: float) -> None:
        """Go on with a velocity along x and y [m/s] that wheels do not measure; its variance grows [m^2/s^2]."""
        self.velocity[:2] = velocity
        grown = variance - self._velocity_noise
        self.covariance[VELOCITY, VELOCITY] += grown
        self.covariance[VELOCITY + 1, VELOCITY + 1] += grown
        self.rolling[:] = 0.0

    def integrate(self, heading: float, period: float, imu_time: float, unknown: float) -> None:
        """Propagate the pose over an interval.

        Args:
            heading: Heading in its middle [rad].
            period: Its length T [s].
            imu_time: Time s of it that the gyroscope covers [s].
            unknown: Variance of the yaw besides [rad^2].
        """
        x, y, _ = self.velocity.tolist()
        variances = (self.slide * math.hypot(x, y) * period, unknown, self._variances.walk * period)
        kernel.integrate(self._block.address, heading, period, imu_time, variances)

    def settle_height(self, deviation: float) -> None:
        """Measure the height, which is as expected, with a standard deviation [m]."""
        kernel.condition(self._block.address, 2, deviation * deviation)

    @property
    def velocity_covariance(self) -> np.ndarray:
        """Covariance of v, shape (3, 3) [m^2/s^2]; a new array."""
        return np.ascontiguousarray(self.covariance[VELOCITY:GYRO_BIAS, VELOCITY:GYRO_BIAS])


_ORIGIN = np.zeros(3)
_NO_TILT = np.zeros(2)
