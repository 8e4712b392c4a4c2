"""A Kalman filter of the base's motion on wheels: velocity, the gyroscope's bias, radii, and their covariance."""

import math

import numpy as np

DOUBTED = 1e6
"""Variance of what a wheel tells that is not believed [m^2/s^2]."""

OUTLIERS = 0.02
"""Share of the cycles in which a wheel slips, before anything is measured."""

SLIDE = 5e-3
"""Deviation of the way after a metre, by slip that lasts longer than a cycle [m/sqrt(m)]."""

SLIPPING = 4.0
"""Range of the speeds of a wheel that slips, along each axis [m/s]."""


class ContactKalman:
    """Velocity of the base, bias of the gyroscope and errors of the wheels' radii, with a covariance that has the pose.

    The axes are those of the base, turned about the world's vertical by its heading. In a cycle of the time T the base
    moves with the velocity v and turns by u - b s, where u is what the gyroscope tells for the time s, and b its bias.
    A wheel at r that rolls tells the velocity w = v + (u - b s) / T n x r - e w, where n is the vertical and e the
    share by which its radius is larger than it is said to be. The velocity is a random walk. The shares are not
    estimated: what all have in common cannot be seen. That they are not known counts (a Schmidt-Kalman filter).
    Errors are those of the position in the world (0 to 2), the heading (3), the velocity (4 to 6), the bias (7) and the
    shares (8 and more). Source: M. Bloesch et al., "State estimation for legged robots", RSS 2012, with wheels that
    roll in place of feet that stand.

    Args:
        count: Number of wheels k.
        acceleration: Deviation of the change of the velocity [m/s^2].
        noise: Density of the gyroscope's white noise [rad/s/sqrt(Hz)].
        bias: Deviation of b at the start [rad/s].
        walk: Random walk of b [rad/s/sqrt(s)].
        radius: Deviation of e.

    Attributes:
        covariance: Of the errors, shape (8 + k, 8 + k); live.
        velocity: v, shape (3,) [m/s]; live.
        bias: b [rad/s].
        rolling: Probability that each wheel rolls and does not slip, shape (k,); live.
    """

    def __init__(self, count: int, acceleration: float, noise: float, bias: float, walk: float, radius: float):
        size = 8 + count
        self._acceleration, self._noise, self._walk = acceleration**2, noise**2, walk**2
        self._first, self._radius = bias**2, radius**2
        self.covariance, self._step = np.zeros((2, size, size))
        self._state = np.zeros(size)
        self.velocity = self._state[4:7]
        self.rolling = np.ones(count)
        self._across, self._errors = np.zeros((2, count, 3))
        self._rows, self._variances = np.zeros((count, 3, size)), np.zeros((count, 3))
        self._rows[:, range(3), range(4, 7)] = 1.0
        self._wheels = np.arange(count)
        self.start()

    def start(self) -> None:
        """Begin at rest, at a pose that is known."""
        self._state[:], self.covariance[:], self.rolling[:] = 0.0, 0.0, 1.0
        self.covariance[7, 7] = self._first
        self.covariance[8 + self._wheels, 8 + self._wheels] = self._radius

    def place(self) -> None:
        """Take the pose for known."""
        self.covariance[:4], self.covariance[:, :4] = 0.0, 0.0

    @property
    def bias(self) -> float:
        """See above."""
        return float(self._state[7])

    @property
    def bias_variance(self) -> float:
        """Variance of the bias [rad^2/s^2]."""
        return float(self.covariance[7, 7])

    def accelerate(self, turn: float, period: float) -> None:
        """Let the velocity change for `period` [s], in which its axes turn by an angle [rad]."""
        step = self._identity()
        cosine, sine = math.cos(turn), math.sin(turn)
        step[4, 4] = step[5, 5] = cosine
        step[4, 5], step[5, 4] = sine, -sine
        self.velocity[:] = step[4:7, 4:7] @ self.velocity
        self._propagate()
        for axis in (4, 5, 6):
            self.covariance[axis, axis] += self._acceleration * period * period

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
            believed: Which wheels count, shape (k,).
        """
        self._across[:, 0], self._across[:, 1] = -arms[:, 1], arms[:, 0]
        self._rows[:, :, 7] = -share * self._across
        # what is expected and not what is told: its noise would be taken for an error of the radius
        self._rows[self._wheels, :, 8 + self._wheels] = -(self.velocity + (rate - share * self.bias) * self._across)
        size = len(self._state)
        rows, errors = self._rows.reshape(-1, size), self._errors
        np.subtract(told, (rows @ self._state).reshape(-1, 3), out=errors)
        errors -= rate * self._across
        self._variances[:] = (deviations * deviations)[:, None]
        self._judge(believed)
        self._variances[~believed] = DOUBTED
        mapped = rows @ self.covariance
        spread = mapped @ rows.T
        spread.ravel()[:: len(spread) + 1] += self._variances.ravel()
        gain = np.linalg.solve(spread, mapped).T
        gain[8:] = 0.0
        self._state += gain @ errors.ravel()
        left = self._identity()
        left -= gain @ rows
        self._propagate()
        self.covariance += (gain * self._variances.ravel()) @ gain.T

    def _judge(self, believed: np.ndarray) -> None:
        """Compute the probabilities that wheels roll, by the errors of what they tell, and leave out those that do not.

        Raises nothing where all contradict: then the prediction is wrong, and not the wheels.
        """
        for index, row in enumerate(self._rows):
            spread = row @ self.covariance @ row.T
            spread.ravel()[::4] += self._variances[index]
            error = self._errors[index]
            distance = float(error @ np.linalg.solve(spread, error))
            density = math.exp(-0.5 * min(distance, 700.0)) / math.sqrt((2.0 * math.pi) ** 3 * np.linalg.det(spread))
            rolls = (1.0 - OUTLIERS) * density
            self.rolling[index] = rolls / (rolls + OUTLIERS / SLIPPING**3)
        likely = believed & (self.rolling > 0.5)
        if np.count_nonzero(likely) > 1:
            believed[:] = likely
        self.rolling[~believed] = np.minimum(self.rolling[~believed], 0.5)

    def advance(self, heading: float, period: float, time: float, unknown: float) -> None:
        """Let the pose follow velocity and turn.

        Args:
            heading: Heading in the middle of the cycle [rad].
            period: Time of the cycle T [s].
            time: Time for which the gyroscope has told something s [s].
            unknown: Variance of the turn besides [rad^2].
        """
        step = self._identity()
        cosine, sine = math.cos(heading), math.sin(heading)
        x, y, _ = self.velocity.tolist()
        step[0, 4], step[0, 5], step[0, 3] = cosine * period, -sine * period, -(sine * x + cosine * y) * period
        step[1, 4], step[1, 5], step[1, 3] = sine * period, cosine * period, (cosine * x - sine * y) * period
        step[2, 6] = period
        step[3, 7] = -time
        self._propagate()
        slid = SLIDE * SLIDE * math.hypot(x, y) * period
        self.covariance[0, 0] += slid
        self.covariance[1, 1] += slid
        self.covariance[3, 3] += self._noise * time + unknown
        self.covariance[7, 7] += self._walk * period

    def settle(self, deviation: float) -> None:
        """Take the height for known with a deviation [m]."""
        column = self.covariance[:, 2].copy()
        self.covariance -= np.outer(column, column / (column[2] + deviation * deviation))

    def _identity(self) -> np.ndarray:
        self._step[:] = 0.0
        self._step.ravel()[:: len(self._step) + 1] = 1.0
        return self._step

    def _propagate(self) -> None:
        np.copyto(self.covariance, self._step @ self.covariance @ self._step.T)
