"""Motion of several joints through points with times."""

from bisect import bisect_right

import numpy as np


class ViaPoints:
    """Polynomials through points, one for each pair of neighbours: quintic, cubic or linear, by what the points give.

    With the duration T of a piece, p, v and a at its begin (0) and end (1), and the mean velocity m = (p1 - p0) / T,
    the coefficients of t, t^2, ... are

        positions:         m
        and velocities:    v0, (3 m - 2 v0 - v1) / T, (v0 + v1 - 2 m) / T^2
        and accelerations: v0, a0 / 2,
                           (20 m - 8 v1 - 12 v0 - (3 a0 - a1) T) / (2 T^2),
                           (-30 m + 14 v1 + 16 v0 + (3 a0 - 2 a1) T) / (2 T^3),
                           (12 m - 6 (v0 + v1) - (a0 - a1) T) / (2 T^4)

    as in ros_control's joint_trajectory_controller (wiki.ros.org/joint_trajectory_controller, on interpolation).

    Args:
        times: Of the points, increasing, shape (k,) with k > 1 [s].
        positions: Shape (k, n) [rad, m].
        velocities: Shape (k, n) [rad/s, m/s]; None: the motion is linear.
        accelerations: Shape (k, n) [rad/s2, m/s2]; None: it is cubic.

    Attributes:
        end: Time of the last point [s].
        last: Positions there, shape (n,) [rad, m].
    """

    def __init__(
        self,
        times: np.ndarray,
        positions: np.ndarray,
        velocities: np.ndarray | None = None,
        accelerations: np.ndarray | None = None,
    ):
        self._times, self.last, self.end = times.tolist(), positions[-1].copy(), float(times[-1])
        self._durations = np.diff(times)
        self._piece = 0
        self._coefficients = np.zeros((len(times) - 1, 6, positions.shape[1]))
        self._coefficients[:, 0] = positions[:-1]
        step = self._durations[:, None]
        mean = np.diff(positions, axis=0) / step
        if velocities is None:
            self._coefficients[:, 1] = mean
        elif accelerations is None:
            self._set_cubic(step, mean, velocities[:-1], v1=velocities[1:])
        else:
            self._set_quintic(
                step, mean, velocities[:-1], v1=velocities[1:], a0=accelerations[:-1], a1=accelerations[1:]
            )

    def _set_cubic(self, step: np.ndarray, mean: np.ndarray, v0: np.ndarray, v1: np.ndarray) -> None:
        c = self._coefficients
        c[:, 1] = v0
        c[:, 2] = (3.0 * mean - 2.0 * v0 - v1) / step
        c[:, 3] = (v0 + v1 - 2.0 * mean) / step**2

    def _set_quintic(
        self, step: np.ndarray, mean: np.ndarray, v0: np.ndarray, v1: np.ndarray, a0: np.ndarray, a1: np.ndarray
    ) -> None:
        c = self._coefficients
        c[:, 1], c[:, 2] = v0, 0.5 * a0
        c[:, 3] = (20.0 * mean - 8.0 * v1 - 12.0 * v0 - (3.0 * a0 - a1) * step) / (2.0 * step**2)
        c[:, 4] = (-30.0 * mean + 14.0 * v1 + 16.0 * v0 + (3.0 * a0 - 2.0 * a1) * step) / (2.0 * step**3)
        c[:, 5] = (12.0 * mean - 6.0 * (v0 + v1) - (a0 - a1) * step) / (2.0 * step**4)

    def at(self, time: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """Write positions and velocities at a time, shape (n,) each [rad, m], [rad/s, m/s]; allocates nothing.

        At the end the joints are at the last point, at rest.
        """
        if time >= self.end:
            position[:] = self.last
            velocity.fill(0.0)
            return
        while time >= self._times[self._piece + 1]:
            self._piece += 1
        if time < self._times[self._piece]:
            self._piece = max(bisect_right(self._times, time) - 1, 0)
        c = self._coefficients[self._piece]
        t = max(time - self._times[self._piece], 0.0)
        position[:] = c[5]
        velocity.fill(0.0)
        for power in (4, 3, 2, 1, 0):  # Horner, of the polynomial and of its derivative
            velocity *= t
            velocity += position
            position *= t
            position += c[power]

    def extremes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute the lowest and highest positions and the highest speeds of the motion, shape (n,) each.

        They are those at nine places of each piece, its ends included.
        """
        samples = 9
        t = np.linspace(0.0, 1.0, samples)[:, None, None] * self._durations[None, :, None]
        position = np.broadcast_to(self._coefficients[:, 5], (samples, *self._coefficients[:, 5].shape)).copy()
        velocity = np.zeros_like(position)
        for power in (4, 3, 2, 1, 0):
            velocity = velocity * t + position
            position = position * t + self._coefficients[:, power]
        return position.min(axis=(0, 1)), position.max(axis=(0, 1)), np.abs(velocity).max(axis=(0, 1))
