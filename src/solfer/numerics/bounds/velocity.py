"""Bounds of joint velocities that keep joints in their ranges."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.errors import ConfigError, NotFinite, SizeMismatch
from solfer.numerics.compilation import cached


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
        speed: Largest speeds, as above.
        limits: All three in one array, shape (3, n).
        rate: 1 / T, or of a longer period, shape (1,) [1/s]; live.
        update: Computes the bounds at a position [rad, m], shape (n,); allocates nothing.

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
        self.lower_position, self.upper_position, speed = limits
        self._horizon = horizon
        self.rate = np.array([1.0 / horizon])
        self.limits = np.stack((-speed, speed, speed))
        self.lower, self.upper, self.speed = self.limits
        self.update = partial(_bound, self.lower_position, self.upper_position, self.rate, self.limits)

    def set_period(self, period: float) -> None:
        """Set the time for which the next velocities hold [s]: no joint leaves its range within a longer one either."""
        self.rate[0] = 1.0 / max(self._horizon, period)


def bound_velocities(lower_position, upper_position, rates, limits, position):
    """See `VelocityBounds.update`; a NaN stays one."""
    rate = rates[0]
    speed = limits[2]
    for k in range(len(position)):
        up = upper_position[k] - position[k]
        down = lower_position[k] - position[k]
        up = rate * (0.0 if up < 0.0 else up)
        down = rate * (0.0 if down > 0.0 else down)
        limits[0, k] = -speed[k] if down < -speed[k] else down
        limits[1, k] = speed[k] if up > speed[k] else up


_VECTOR = "float64[::1]"
_bound = cached(f"void({_VECTOR}, {_VECTOR}, {_VECTOR}, float64[:, ::1], {_VECTOR})", bound_velocities)


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
