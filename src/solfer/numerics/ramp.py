"""Synchronised minimum-jerk motion from the joints' present state to a goal at rest."""

import numpy as np

from solfer.errors import NotFinite, SizeMismatch


class Ramp:
    """Quintic motion of several joints that start together, possibly in motion, and come to rest together.

    With the duration T, u = t / T, the distance D and the initial velocity v0, acceleration zero at both ends gives

        p(t) = p0 + v0 T u + (10 D - 6 v0 T) u^3 + (8 v0 T - 15 D) u^4 + (6 D - 3 v0 T) u^5,

    the minimum-jerk motion of T. Flash and N. Hogan, "The coordination of arm movements", Journal of Neuroscience
    5(7), 1985, with an initial velocity added.

    Args:
        size: Number of joints n.
        stop_time: Least duration of a ramp in which a joint starts at its full speed; less in proportion where it
            starts slower [s]. A joint that is already at its goal, but in motion, needs it: velocity limits alone
            would let it stop in no time.

    Attributes:
        duration: Duration T of the planned motion [s].
    """

    def __init__(self, size: int, stop_time: float = 0.2):
        self.size = size
        self.stop_time = stop_time
        self.duration = 0.0
        self._start = np.zeros(size)
        self._start_velocity = np.zeros(size)
        self._goal = np.zeros(size)
        # v0 T; coefficients of u^3, u^4, u^5 of the position; those of u^2, u^3, u^4 of the velocity
        self._leap = np.zeros(size)
        self._motion = np.zeros((3, size))
        self._speed = np.zeros((3, size))

    def plan(self, start: np.ndarray, start_velocity: np.ndarray, goal: np.ndarray, limits: np.ndarray) -> float:
        """Plan the shortest motion that keeps all velocity limits; all arguments have shape (n,).

        Args:
            start: Positions at the start [rad, m].
            start_velocity: Velocities at the start [rad/s, m/s]. Where one is beyond its limit, its size
                replaces the limit: the joint then never gets faster than it is.
            goal: Positions at the end [rad, m].
            limits: Velocity limits, positive [rad/s, m/s]; infinite limits bound nothing.

        Returns:
            The duration [s], the same for all joints; zero if all are at rest at their goals.

        Raises:
            SizeMismatch: An argument does not have the size of the ramp.
            NotFinite: A value is NaN or infinite, or no limit bounds the motion.
        """
        start, start_velocity, goal, limits = self._checked(start, start_velocity, goal, limits)
        self._start[:] = start
        self._start_velocity[:] = start_velocity
        self._goal[:] = goal
        self.duration = self._shortest(goal - start, limits)
        if self.duration > 0.0:
            distance = goal - start
            self._leap[:] = start_velocity * self.duration
            self._motion[0] = 10.0 * distance - 6.0 * self._leap
            self._motion[1] = 8.0 * self._leap - 15.0 * distance
            self._motion[2] = 6.0 * distance - 3.0 * self._leap
            np.multiply(self._motion, ((3.0,), (4.0,), (5.0,)), out=self._speed)
            self._speed /= self.duration
        return self.duration

    def at(self, time: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """Write positions [rad, m] and velocities [rad/s, m/s] at `time` after the start [s], shape (n,) each.

        Before the start they are those of the start, from the end on the goal at rest. Allocates nothing.
        """
        if time >= self.duration:
            position[:] = self._goal
            velocity.fill(0.0)
            return
        u = max(time, 0.0) / self.duration
        _evaluate(self._leap, self._motion, u, out=position)
        position *= u
        position += self._start
        _evaluate(self._start_velocity, self._speed, u, out=velocity)

    def _shortest(self, distance: np.ndarray, limits: np.ndarray) -> float:
        """Find the least common duration [s].

        The velocity is v0 a(u) + (D / T) b(u) with a = 1 - 18 u^2 + 32 u^3 - 15 u^4 and b = 30 u^2 (1 - u)^2 >= 0, so
        that |D| / T may be as large as the least value of (limit - sign(D) v0 a(u)) / b(u).
        """
        speed = np.abs(self._start_velocity)
        limits = np.maximum(limits, speed)
        far = distance != 0.0
        ratio = np.divide(
            self._start_velocity * np.sign(distance),
            limits,
            out=np.zeros(self.size),
            where=np.isfinite(limits) & (limits > 0.0),
        )
        mean_speed = limits * _fastest_mean(ratio)
        moving = np.divide(np.abs(distance), mean_speed, out=np.zeros(self.size), where=far & (mean_speed > 0.0))
        shortest = max(
            moving.max(initial=0.0),
            self.stop_time * np.max(np.divide(speed, limits, out=np.zeros(self.size), where=limits > 0.0), initial=0.0),
        )
        if far.any() and shortest == 0.0 or (far & (mean_speed == 0.0)).any():
            raise NotFinite("no velocity limit bounds the motion", expected="positive limits of the joints that move")
        return float(shortest)

    def _checked(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        arrays = tuple(np.asarray(array, dtype=float) for array in arrays)
        for array in arrays:
            if array.shape != (self.size,):
                raise SizeMismatch(f"a ramp of {self.size} joints got numbers of shape {array.shape}")
        if not all(np.isfinite(array).all() for array in arrays[:3]):
            raise NotFinite("a start, velocity or goal of a ramp that is not a finite number")
        if not (arrays[3] >= 0.0).all():
            raise NotFinite("a velocity limit of a ramp that is negative or not a number")
        return arrays


def _fastest_mean(ratio: np.ndarray) -> np.ndarray:
    """Compute the largest mean speed |D| / T over the limit, for a start at `ratio` of the limit, in [-1, 1].

    It is the least value over u of (1 - ratio a(u)) / b(u), for a start towards the goal; its derivative has one zero,
    found by bisection.
    """
    low = np.zeros_like(ratio)
    high = np.ones_like(ratio)
    for _ in range(60):
        u = 0.5 * (low + high)
        slope = 6.0 * ratio * (5.0 * u - 3.0) * (u - u * u) ** 2 + (1.0 - ratio * _decay(u)) * (1.0 - 2.0 * u)
        np.copyto(low, u, where=slope > 0.0)
        np.copyto(high, u, where=slope <= 0.0)
    # a start at the limit has its least value 0.6 at u = 0, where the quotient is 0 / 0
    u = np.maximum(0.5 * (low + high), 1e-4)
    return (1.0 - ratio * _decay(u)) / (30.0 * (u - u * u) ** 2)


def _decay(u: np.ndarray) -> np.ndarray:
    """Compute the part of the initial velocity that is left at u = t / T."""
    return 1.0 - u * u * (18.0 - u * (32.0 - 15.0 * u))


def _evaluate(constant: np.ndarray, coefficients: np.ndarray, u: float, out: np.ndarray) -> None:
    """Write constant + u^2 (c0 + u (c1 + u c2)), the form of both (p - p0) / u and the velocity."""
    np.multiply(coefficients[2], u, out=out)
    out += coefficients[1]
    out *= u
    out += coefficients[0]
    out *= u * u
    out += constant
