"""A Kalman filter of the base's motion on wheels: velocity, gyroscope, tilt, radii, ground, and their covariance."""

import math

import numpy as np

from solfer.components.odometry import kernel

OUTLIERS = np.array((0.02, 1.0 / 4.0**3))
"""Share of the cycles in which a wheel slips, as it is known before, and density of its velocity then [s^3/m^3]."""

SLIDE = 5e-3
"""Deviation of the way after a metre, by slip that lasts longer than a cycle, before anything is known [m/sqrt(m)]."""

WANDERING = 30.0
"""Time in which the error of the tilt that an IMU tells becomes another one [s]."""

RESTING = 1e-3
"""Deviation of the velocity of a robot that is said to rest [m/s]."""

UNEVEN, PATCH = math.radians(0.2), 0.1
"""Deviation of level floors from the plane under four wheels [rad] (DIN 18202: 4 mm within 1 m), and way of the wheels
after which it is another one [m]."""

SCRUB, SCRUBBING = 0.0005, 1.0
"""Deviation of a turn that wheels tell while they scrub, for each metre that they roll [rad/m], and its time [s]."""

PLANE = 3e-4
"""Deviation of the turn of the plane through contacts, by encoders [rad]."""


class ContactKalman:
    """Velocity, bias of the gyroscope, and errors of tilt and radii, with a covariance that has the pose.

    The axes are those of the base, turned about the world's vertical z by its heading. In a cycle of the time T the
    base turns about it by u - (b + n) s, where u is what the gyroscope tells for the time s, b its bias and n its noise
    in this cycle. The velocity v is that of the base at the ground: of a point of it at the mean of the contacts. A
    wheel at r that rolls tells the velocity w = v + ((u - (b + n) s) / T + c) z x r - e w, where c is a turn by which
    wheels scrub, and e the share by which its radius is larger than it is said to be. The velocity is a random walk, c
    a Markov process of first order with a deviation in proportion to what wheels roll. The shares are not estimated:
    what all have in common cannot be seen. That they are not known counts, and so does that wheels do not correct the
    position (a Schmidt-Kalman filter).

    The IMU's tilt has an error t. What the IMU tells of a turn, less what its gyroscope tells without its bias, is how
    t changes, whatever the IMU does to right itself; that t is a Markov process of first order about zero counts as a
    measurement. The plane through the contacts is turned by t + g against what the IMU says, where g is the slope of a
    floor: another such process, of the wheels' way. Where t changes otherwise than it is taken to, the base moves;
    position and tilt know that of each other, and a tilt that errs leads uphill.

    Errors are those of the position in the world (0 to 2), the heading (3), the velocity (4 to 6), the bias about the
    base's z axis (7), the shares (8 and more), the bias about its x and y axes, n, c, and at the end t and g, about x
    and y. Source: M. Bloesch et al., "State
    estimation for legged robots", RSS 2012, with wheels that roll in place of feet that stand.

    Args:
        count: Number of wheels k.
        acceleration: Deviation of the change of the velocity [m/s^2].
        noise: Density of the gyroscope's white noise [rad/s/sqrt(Hz)].
        bias: Deviation of b at the start [rad/s].
        walk: Random walk of b [rad/s/sqrt(s)].
        radius: Deviation of e.
        tilt: Deviation of t [rad].

    Attributes:
        covariance: Of the errors, shape (16 + k, 16 + k); live.
        step: How far corrections put position in the world and heading; who takes it sets it to zero, shape (4,)
            [m, rad]; live.
        velocity: v, shape (3,) [m/s]; live.
        tilt: t, shape (2,) [rad]; live.
        slide: Variance of the way after a metre by wheels that slide [m^2/m].
        axes: From the base's axes to these, shape (3, 3); live, to be written before each cycle.
        rolling: Probability that each wheel rolls and does not slip, shape (k,); live.
    """

    def __init__(
        self, count: int, acceleration: float, noise: float, bias: float, walk: float, radius: float, tilt: float = 0.0
    ):
        size = 16 + count
        self._acceleration, self._noise, self._walk = acceleration**2, noise**2, walk**2
        self._first, self._radius, self._tilt = bias**2, radius**2, tilt**2
        self.covariance, self._state = np.zeros((size, size)), np.zeros(size)
        self.step, self.velocity, self.tilt = self._state[:4], self._state[4:7], self._state[-4:-2]
        self.rolling = np.ones(count)
        self._rows, self._variances, self._told = np.zeros((count, 3, size)), np.zeros((count, 3)), np.zeros((count, 3))
        self._rows[:, range(3), range(4, 7)] = 1.0
        self._wheels, self._noises, self._count = np.arange(count), np.zeros(3), count
        self.slide = SLIDE**2
        self._scratch, self.axes = np.zeros((4, size)), np.eye(3)
        self.start()

    def start(self) -> None:
        """Begin at rest, at a pose that is known but for its tilt."""
        self._state[:], self.covariance[:], self.rolling[:], self.slide = 0.0, 0.0, 1.0, SLIDE**2
        for axis in (7, -8, -7):
            self.covariance[axis, axis] = self._first
        for axis in range(4, 7):
            self.covariance[axis, axis] = RESTING**2
        self.covariance[8 + self._wheels, 8 + self._wheels] = self._radius
        if self._tilt:
            for axis, variance in ((-4, self._tilt), (-3, self._tilt), (-2, UNEVEN**2), (-1, UNEVEN**2)):
                self.covariance[axis, axis] = variance

    def place(self, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> None:
        """Take position and heading for known with variances [m^2, rad^2]."""
        self.covariance[:4], self.covariance[:, :4] = 0.0, 0.0
        for place, variance in ((0, x), (1, y), (3, heading)):
            self.covariance[place, place] = variance

    @property
    def bias(self) -> float:
        """Bias of the gyroscope about the vertical b [rad/s]."""
        (x, y, z), (p, q) = self.axes[2].tolist(), self._state[-8:-6].tolist()
        return x * p + y * q + z * float(self._state[7])

    @property
    def biases(self) -> np.ndarray:
        """Biases of the gyroscope about these axes, shape (3,) [rad/s]; a new array."""
        return self.axes @ (self._state[-8], self._state[-7], self._state[7])

    @property
    def drift(self) -> float:
        """Bias and noise of the gyroscope about the vertical in this cycle b + n [rad/s]."""
        return self.bias + float(self._state[-6])

    @property
    def bias_variance(self) -> float:
        """Variance of the bias about the base's z axis [rad^2/s^2]."""
        return float(self.covariance[7, 7])

    def accelerate(self, turn: float, period: float, rolled: float = 0.0, shaken: float = 0.0) -> None:
        """Let the velocity change.

        Args:
            turn: Angle by which its axes turn [rad].
            period: Time for which [s].
            rolled: Way that wheels roll [m].
            shaken: Variance of what the gyroscope misses between its samples [rad^2/s^2].
        """
        share, variance = -math.expm1(-period / SCRUBBING), (SCRUB * rolled / period) ** 2
        kernel.accelerate(
            self.covariance,
            self._state,
            turn,
            self._acceleration * period * period,
            share,
            variance * share * (2.0 - share),
            self._noise / period + shaken,
        )

    def scrub(self, variance: float) -> None:
        """Let the turn by which wheels scrub have a variance of this or more [rad^2/s^2]."""
        self.covariance[-5, -5] = max(float(self.covariance[-5, -5]), variance)

    def lean(
        self, arm: np.ndarray, heading: float, turn: float, change: np.ndarray, time: float, way: float, shaken: float
    ) -> None:
        """Let the error of the tilt change.

        Args:
            arm: From the base's origin to the mean of the contacts, shape (3,) [m].
            heading: Heading [rad].
            turn: Turn of the axes [rad].
            change: What the IMU tells of a turn, less that of its gyroscope without its bias, shape (2,) [rad].
            time: Time for which the IMU has told something [s].
            way: How far the wheels have gone [m].
            shaken: Variance of what the gyroscope misses between its samples [rad^2/s^2].
        """
        if not self._tilt:
            return
        slope = -math.expm1(-way / PATCH)
        kernel.lean(
            self.covariance, self._state, arm, self.axes, heading, turn, change, time,
            self._noise * time + shaken * time * time, slope, UNEVEN**2 * slope * (2.0 - slope),
        )  # fmt: skip

    def right(self, time: float) -> None:
        """Take the tilt of the IMU for as right as it is for a time [s]."""
        if self._tilt:
            kernel.right(self.covariance, self._state, 2.0 * WANDERING / time * self._tilt, self._scratch, self._count)

    def rest(self, angular: np.ndarray, time: float) -> None:
        """Take what the gyroscope tells of a robot that rests, axes of the base, shape (3,) [rad/s], for a time [s]."""
        kernel.rest(self.covariance, self._state, angular, self._noise / time, self._scratch, self._count)

    def level(self, x: float, y: float) -> bool:
        """Take how the plane through the contacts is turned about the axes x and y, by the IMU [rad].

        Returns:
            Whether it can be that of level ground.
        """
        if not self._tilt:
            return True
        return bool(kernel.level(self.covariance, self._state, x, y, PLANE**2, self._scratch, self._count))

    def correct(
        self,
        told: np.ndarray,
        arms: np.ndarray,
        rate: float,
        share: float,
        deviations: np.ndarray,
        believed: np.ndarray,
    ) -> None:
        """Take what wheels tell.

        Args:
            told: w, shape (k, 3) [m/s].
            arms: r, shape (k, 3) [m].
            rate: u / T [rad/s].
            share: s / T.
            deviations: Deviations of w, shape (k,) [m/s].
            believed: Which wheels count, shape (k,); those that more likely slip are taken out.
        """
        self._told[:] = told
        self._variances[:] = (deviations * deviations)[:, None]
        kernel.correct(
            self.covariance, self._state, self._rows, self._told, arms, rate, share, self.axes[2], self._variances,
            OUTLIERS, believed, self.rolling, self._scratch,
        )  # fmt: skip

    def advance(self, heading: float, period: float, time: float, unknown: float) -> None:
        """Let the pose follow velocity and turn.

        Args:
            heading: Heading in the middle of the cycle [rad].
            period: Time of the cycle T [s].
            time: Time for which the gyroscope has told something s [s].
            unknown: Variance of the turn besides [rad^2].
        """
        x, y, _ = self.velocity.tolist()
        slid = self.slide * math.hypot(x, y) * period
        self._noises[:] = slid, unknown, self._walk * period
        kernel.advance(self.covariance, heading, period, time, self.axes[2], self.velocity, self._noises)

    def settle(self, deviation: float) -> None:
        """Take the height for known with a deviation [m]."""
        kernel.settle(self.covariance, 2, deviation * deviation, self._scratch)
