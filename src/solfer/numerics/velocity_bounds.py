"""Bounds of joint velocities that keep joints in their ranges."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import ConfigError, NotFinite, SizeMismatch


class VelocityBounds:
    """Bounds of the velocities of n joints, from limits of their positions and speeds.

    upper = min(v_max, max(q_max - q, 0) / T) and lower = max(-v_max, min(q_min - q, 0) / T): a joint is at most as fast
    as to reach the end of its range in the horizon T, and slows down exponentially before it where T is longer
    than the period of the control cycle. A joint outside its range may come back as fast as it can, and need not: zero
    velocity is always within the bounds.

    Args:
        joints: Names of the joints, for errors.
        lower_position: Ends of the ranges [rad, m], shape (n,); -inf where there is none.
        upper_position: The other ends; inf where there is none.
        speed: Largest speeds v_max, not negative [rad/s, m/s], shape (n,); inf where there is none.
        horizon: T [s], not less than the period of the control cycle.

    Attributes:
        lower_position: Ends of the ranges, as above.
        upper_position: The other ends, as above.
        lower: Lower bounds as of the last `update` [rad/s, m/s], shape (n,).
        upper: Upper bounds as of the last `update` [rad/s, m/s], shape (n,).

    Raises:
        SizeMismatch: An array does not have one number a joint.
        NotFinite: A limit is NaN.
        ConfigError: Limits contradict each other, or the horizon is not positive.
    """

    def __init__(
        self,
        joints: Sequence[str],
        lower_position: np.ndarray,
        upper_position: np.ndarray,
        speed: np.ndarray,
        horizon: float,
    ):
        limits = [np.array(limit, dtype=float) for limit in (lower_position, upper_position, speed)]
        _check(joints, *limits)
        if not 0.0 < horizon < np.inf:
            raise ConfigError(f"a horizon of {horizon:g} s", expected="a positive number")
        self.lower_position, self.upper_position, self._speed = limits
        self._least, self._rate = -self._speed, 1.0 / horizon
        self.lower, self.upper = self._least.copy(), self._speed.copy()

    def update(self, position: np.ndarray) -> None:
        """Compute the bounds at `position` [rad, m], shape (n,). Allocates nothing."""
        np.subtract(self.upper_position, position, out=self.upper)
        np.maximum(self.upper, 0.0, out=self.upper)
        self.upper *= self._rate
        np.minimum(self.upper, self._speed, out=self.upper)
        np.subtract(self.lower_position, position, out=self.lower)
        np.minimum(self.lower, 0.0, out=self.lower)
        self.lower *= self._rate
        np.maximum(self.lower, self._least, out=self.lower)


def _check(joints: Sequence[str], lower: np.ndarray, upper: np.ndarray, speed: np.ndarray) -> None:
    for limit in (lower, upper, speed):
        if limit.shape != (len(joints),):
            raise SizeMismatch(f"limits of shape {limit.shape} for {len(joints)} joints")
    for index, joint in enumerate(joints):
        if np.isnan((lower[index], upper[index], speed[index])).any():
            raise NotFinite("a limit is not a number", where=f"joint '{joint}'")
        if lower[index] > upper[index]:
            raise ConfigError(
                f"the lower limit {lower[index]:g} is above the upper one {upper[index]:g}",
                where=f"joint '{joint}'",
                expected="a lower limit that is not above the upper one",
            )
        if speed[index] < 0.0:
            raise ConfigError(
                f"a largest speed of {speed[index]:g}",
                where=f"joint '{joint}'",
                expected="a number that is not negative",
            )
