"""What all references that need no program have in common."""

import abc
import math

import numpy as np

from solfer.numerics.rotations import quaternion_product

QUANTITY_SIZES = {"position": (3, 3), "orientation": (4, 3), "pose": (7, 6)}
"""How many numbers a quantity has, and how many its velocity; a posture has one of both for each joint."""

SAMPLES_PER_PERIOD = 64
"""Number of times at which the speed is sampled in each period of a motion."""


class ReferenceGenerator(abc.ABC):
    """A quantity over time, from rest to its last value.

    Positions [m] come before quaternions (x, y, z, w); velocities are linear [m/s], then angular in the axes of the
    reference [rad/s]. Of a posture there is one number for each joint [rad, m].

    Args:
        size: How many numbers it has.
        rates: How many numbers its velocity has.
        duration: Time after which it stays at its last value [s]; inf: it has no end.

    Attributes:
        size, rates, duration: See above.
        origin: Where it began, shape (size,).
    """

    def __init__(self, size: int, rates: int, duration: float):
        self.size = size
        self.rates = rates
        self.duration = duration
        self.origin = np.zeros(size)
        if size != rates:
            self.origin[-1] = 1.0

    def start(self, origin: np.ndarray) -> None:
        """Begin at a value, shape (size,)."""
        self.origin[:] = origin

    @abc.abstractmethod
    def at(self, time: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """Write value and velocity at a time since the start [s], shape (size,) and (rates,). Allocates nothing."""

    @abc.abstractmethod
    def sample_times(self) -> np.ndarray:
        """Return the times at which the speed is sampled, shape (k,) [s]."""

    def velocities(self) -> np.ndarray:
        """Compute the velocities at the times of `sample_times`, shape (k, rates)."""
        position = np.zeros(self.size)
        rows = np.zeros((len(self.sample_times()), self.rates))
        for row, time in zip(rows, self.sample_times(), strict=True):
            self.at(float(time), position, row)
        return rows


class OffsetReference(ReferenceGenerator):
    """A reference that adds an offset to the first numbers of its origin.

    Args:
        size: How many numbers it has.
        rates: How many numbers its velocity has.
        count: How many numbers the offset has.
        duration: See `ReferenceGenerator`.
    """

    def __init__(self, size: int, rates: int, count: int, duration: float):
        super().__init__(size, rates, duration)
        self._offsets = np.zeros(size)
        self._rates = np.zeros(rates)
        self._offset = self._offsets[:count]
        self._rate = self._rates[:count]

    def at(self, time: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """See `ReferenceGenerator.at`."""
        self._move(min(max(time, 0.0), self.duration))
        np.add(self.origin, self._offsets, out=position)
        np.copyto(velocity, self._rates)

    @abc.abstractmethod
    def _move(self, time: float) -> None:
        """Write offset and rate at a time from 0 to the duration [s]."""


class Swing(OffsetReference):
    """An offset that is a function of a phase: a circle, or a sine.

    The phase gets its speed within a time F smoothly, by s' = u^2 (3 - 2 u) with u = t / F, and loses it in the same
    way. F is a quarter of a period, so that this takes no more acceleration than the motion itself, or all there is.

    Args:
        size: How many numbers it has.
        rates: How many numbers its velocity has.
        cosine, sine: Offsets c and d of c (cos(phase) - 1) + d sin(phase), shape (n,).
        period: [s].
        turns: Number of periods; None: without end.
    """

    def __init__(
        self, size: int, rates: int, cosine: np.ndarray, sine: np.ndarray, *, period: float, turns: float | None
    ):
        phase_time = math.inf if turns is None else turns * period
        self._fade = min(0.25 * period, phase_time)
        self._phase_time = phase_time
        self._period = period
        self._cosine = cosine
        self._sine = sine
        self._frequency = math.tau / period
        super().__init__(size, rates, len(cosine), duration=phase_time + self._fade)
        self._work = np.zeros(len(cosine))

    def sample_times(self) -> np.ndarray:
        """See `ReferenceGenerator.sample_times`."""
        return np.arange(0.0, min(self.duration, self._fade + self._period), self._period / SAMPLES_PER_PERIOD)

    def _move(self, time: float) -> None:
        fade = self._fade
        left = self.duration - time
        ratio = min(time, left, fade) / fade
        faded = fade * ratio**3 * (1.0 - 0.5 * ratio)
        if ratio == 1.0:
            phase_time = time - 0.5 * fade
        elif time <= left:
            phase_time = faded
        else:
            phase_time = self._phase_time - faded
        phase = self._frequency * phase_time
        cos = math.cos(phase)
        sin = math.sin(phase)
        rate = self._frequency * ratio * ratio * (3.0 - 2.0 * ratio)
        np.multiply(self._cosine, cos - 1.0, out=self._offset)
        np.multiply(self._sine, sin, out=self._work)
        self._offset += self._work
        np.multiply(self._cosine, -rate * sin, out=self._rate)
        np.multiply(self._sine, rate * cos, out=self._work)
        self._rate += self._work


class LineReference(OffsetReference):
    """A straight line: the fraction u of the time T makes 10 u^3 - 15 u^4 + 6 u^5 of the path, from rest to rest.

    Args:
        size: How many numbers it has.
        rates: How many numbers its velocity has.
        to: Where it ends [m], shape (3,).
        speed: Largest speed [m/s]; None: it is that of the duration.
        duration: T [s]; None: it is that of the speed.
        back: Whether it goes back again, in the same time.
        absolute: Whether `to` is a place, not relative to the origin.
    """

    PEAK = 1.875
    """Largest speed, relative to the mean one."""

    def __init__(
        self,
        size: int,
        rates: int,
        to: np.ndarray,
        *,
        speed: float | None = None,
        duration: float | None = None,
        back: bool = False,
        absolute: bool = False,
    ):
        super().__init__(size, rates, len(to), duration=0.0)
        self._to = to
        self._is_absolute = absolute
        self._speed = speed
        self._given = duration
        self._back = back
        self._displacement = to.copy()
        self._time = 1.0
        self.start(self.origin.copy())

    def start(self, origin: np.ndarray) -> None:
        """See `ReferenceGenerator.start`."""
        super().start(origin)
        if self._is_absolute:
            np.subtract(self._to, self.origin[: len(self._to)], out=self._displacement)
        length = float(np.linalg.norm(self._displacement))
        time = self._given if self._speed is None else self.PEAK * length / self._speed
        self._time = max(time or 0.0, 1e-3)
        self.duration = 2.0 * self._time if self._back else self._time

    def sample_times(self) -> np.ndarray:
        """See `ReferenceGenerator.sample_times`."""
        return np.linspace(0.0, self._time, SAMPLES_PER_PERIOD + 1)

    def _move(self, time: float) -> None:
        sign = 1.0
        if time > self._time:  # it goes back: else it has ended
            time = 2.0 * self._time - time
            sign = -1.0
        u = time / self._time
        np.multiply(self._displacement, u**3 * (10.0 + u * (6.0 * u - 15.0)), out=self._offset)
        np.multiply(self._displacement, sign * 30.0 * (u * (1.0 - u)) ** 2 / self._time, out=self._rate)


def turned_by(by: np.ndarray, quaternion: np.ndarray) -> tuple[float, ...]:
    """Turn a quaternion by another one in the axes of the reference, shape (4,) each."""
    return quaternion_product(by.tolist(), quaternion.tolist())
