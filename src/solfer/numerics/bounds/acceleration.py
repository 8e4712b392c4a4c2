"""Bounds of joint accelerations that keep joints in their ranges, with their braking distances."""

import math

import numpy as np

from solfer.numerics.compilation import cached


class AccelerationBounds:
    """Bounds of the accelerations of n joints, from limits of their positions and speeds.

    A joint that brakes with a / 2 needs the way v^2 / a: at the distance d from the end of its range it may be as fast
    as sqrt(a d), where the other half of a makes up for the delay of a cycle, and near the end as d / 2T, so that it
    comes to rest there without swinging. It is to be no faster than that, nor than its drive, after the horizon T:

        upper = max((min(v_max, sqrt(a d), d / 2T) - v) / T, -a),   d = max(q_max - q, 0)

    and the lower bound is its mirror. A joint beyond its range, or too fast, brakes with a; at rest it need not come
    back. So the bounds never contradict each other, whatever is measured.

    Args:
        lower_position: Ends of the ranges [rad, m], shape (n,); -inf where there is none.
        upper_position: The other ends; inf where there is none.
        speed: Largest speeds v_max [rad/s, m/s], shape (n,); inf where there is none.
        braking: a, positive [rad/s^2, m/s^2].
        horizon: T, not less than the period of the control cycle [s].

    Attributes:
        lower: Lower bounds as of the last `update` [rad/s^2, m/s^2], shape (n,).
        upper: Upper bounds as of the last `update` [rad/s^2, m/s^2], shape (n,).
        speed: v_max [rad/s, m/s], shape (n,); live.
        braking: a [rad/s^2, m/s^2]; may be set before each `update`.
    """

    def __init__(
        self,
        lower_position: np.ndarray,
        upper_position: np.ndarray,
        speed: np.ndarray,
        *,
        braking: float,
        horizon: float,
    ):
        self._limits = np.array((lower_position, upper_position, speed), dtype=float)
        self.speed = self._limits[2]
        self.braking = braking
        self._horizon = horizon
        self._bounds = np.full_like(self._limits[:2], np.inf)
        self.lower, self.upper = self._bounds
        self.lower[:] = -np.inf

    def update(self, position: np.ndarray, velocity: np.ndarray) -> None:
        """Compute the bounds at `position` [rad, m] and `velocity` [rad/s, m/s], shape (n,) each. Allocates nothing."""
        _bound(position, velocity, self._limits, self.braking, self._horizon, self._bounds)


def _bound_all(position, velocity, limits, braking, horizon, bounds):
    """See `AccelerationBounds.update`; a NaN stays one."""
    lower_position = limits[0]
    upper_position = limits[1]
    speed = limits[2]
    for k in range(len(position)):
        up = upper_position[k] - position[k]
        down = position[k] - lower_position[k]
        up = 0.0 if up < 0.0 else up
        down = 0.0 if down < 0.0 else down
        fastest = min(math.sqrt(braking * up), 0.5 * up / horizon)
        slowest = min(math.sqrt(braking * down), 0.5 * down / horizon)
        fastest = speed[k] if fastest > speed[k] else fastest
        slowest = speed[k] if slowest > speed[k] else slowest
        most = (fastest - velocity[k]) / horizon
        least = (-slowest - velocity[k]) / horizon
        bounds[0, k] = braking if least > braking else least
        bounds[1, k] = -braking if most < -braking else most


_bound = cached("void(float64[::1], float64[::1], float64[:, ::1], float64, float64, float64[:, ::1])", _bound_all)
