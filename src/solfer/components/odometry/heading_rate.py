"""How fast the robot turns about the vertical, from wheels and a gyroscope whose bias is learned."""

import math

LIKELY = 5.0
"""Deviations that noise has at most."""

UNKNOWN = 2e-3
"""What a robot may sway at rest besides [rad/s]."""


class HeadingRate:
    """Fuses turns of wheels and of a gyroscope, each a small angle about the vertical.

    The gyroscope's rate has white noise of the density s and a bias b, a random walk of the density u. Wheels tell
    turns with a deviation in proportion to the way: they slip, and their radii are not known better. The turn is the
    mean, weighted by the inverse variances. Where the robot rests, wheels are exact, and b follows by a Kalman filter.

    Args:
        noise: s [rad/s/sqrt(Hz)].
        bias: Deviation of b at the start [rad/s].
        walk: u [rad/s/sqrt(s)].

    Attributes:
        bias: b [rad/s].
        variance: Its variance [rad^2/s^2].
        heading_variance: Variance of the sum of all turns [rad^2].
    """

    def __init__(self, noise: float, bias: float, walk: float):
        self._noise, self._first, self._walk = noise**2, bias**2, walk**2
        self.bias, self.variance, self.heading_variance = 0.0, self._first, 0.0

    def reset(self) -> None:
        """Forget the bias."""
        self.bias, self.variance, self.heading_variance = 0.0, self._first, 0.0

    def explains(self, turn: float, time: float) -> bool:
        """Return whether bias and noise explain a turn that the gyroscope tells within `time` [s]."""
        deviation = math.sqrt(self.variance + self._noise / time)
        return abs(turn / time - self.bias) <= LIKELY * deviation + UNKNOWN

    def learn(self, turn: float, time: float) -> None:
        """Take a turn that the gyroscope tells within `time` [s], while the robot rests, for its bias."""
        variance = self._noise / time
        gain = self.variance / (self.variance + variance)
        self.bias += gain * (turn / time - self.bias)
        self.variance *= 1.0 - gain

    def turn(self, gyroscope: float, time: float, wheels: float, wheels_variance: float) -> float:
        """Return the turn within `time` [s].

        Args:
            gyroscope: What it tells [rad].
            time: The time [s]; 0: the gyroscope tells nothing.
            wheels: What wheels tell [rad].
            wheels_variance: Its variance [rad^2].
        """
        if time <= 0.0:
            self.heading_variance += wheels_variance
            return wheels
        self.variance += self._walk * time
        variance = self._noise * time + self.variance * time * time
        share = wheels_variance / (wheels_variance + variance)
        self.heading_variance += share * variance
        return wheels + share * (gyroscope - self.bias * time - wheels)
