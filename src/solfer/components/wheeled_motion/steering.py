"""Desired directions of wheels: by the desired motion of the base, and by the errors of the vertices."""

import math

import numpy as np

from solfer.components.wheeled_motion.kernel import LAW, TUNED, WHEEL_DTYPE
from solfer.components.wheeled_motion.tags import SteeringRecord
from solfer.numerics.planar_move import PlanarMove

RELAXATION_LENGTH = 1e-3
"""Way within which a wheel's direction follows that of its vertex, where errors across it count [m]."""


class Steering:
    """The directions in which all wheels are to roll, by one of two laws.

    With a gain of errors across the wheels, a wheel has to roll so that its vertex stays with its reference: in the
    direction of v + K (1 - d / |e|) e with the desired velocity v of the vertex, its error e and the gain K,
    where |e| is larger than d = 2 mm, and of v where it is not. The slower that is, the slower it is followed: within
    the way of `RELAXATION_LENGTH`. A wheel that is to be still rests where its error is small, until it is larger.

    Without it, two directions are merged, each low-passed the more, the slower what points there is: that of the wheel
    in the desired motion of the base, about its instantaneous centre of rotation, and that of its vertex' error. Each
    is turned by half a revolution, and its speed changes sign, where it is farther from the last direction of the wheel
    than a quarter of a revolution and 10 degrees. In the original program it is called `reactif`. As there, the heading
    has no sign, and to the right of the x-axis of the world a wheel is steered as if the base were to the left of it.

    Args:
        tuning: Gains and margins.
        period: Period of the control cycle [s].
        count: Number of wheels.
        rests: Whether wheels stop to steer where no motion is desired and their vertices are near their references.
        across: Gain of errors across the wheels [1/s]; 0: as in the original.

    Attributes:
        angles: Directions in which wheels are to roll in the world, shape (count,) [rad]; live.
        aims: Where wheels aim, seen from the heading, shape (count,) [rad]; live.
        speeds: Speeds of the vertices in the desired motion, shape (count,) [m/s]; live.
        measured: Directions in which wheels roll now, in the world, shape (count,) [rad]; live.
        steered: These four, shape (4, count).
        law: Numbers of the law, shape (1,), for `solfer.components.wheeled_motion.kernel`, which computes it.
        wheels: State of all wheels there, records `WHEEL_DTYPE`, shape (count,).
        before: Place and heading of the base in the last cycle, shape (3,) [m, rad].
        step: Time since the cycle before [s].
    """

    def __init__(self, tuning: SteeringRecord, period: float, count: int, rests: bool, across: float = 0.0):
        self._given = period
        self.step = period
        self.law = np.array([(across, period / RELAXATION_LENGTH, rests, *self.numbers(tuning), period)], dtype=LAW)
        self.wheels = np.zeros(count, WHEEL_DTYPE)
        self.before = np.zeros(3)
        self.steered = np.zeros((4, count))
        self.angles, self.aims, self.speeds, self.measured = self.steered

    def numbers(self, tuning: SteeringRecord) -> tuple[float, ...]:
        """Return the numbers `TUNED` of the law for other gains and margins, shape (6,)."""
        margins = tuning.damp_icm / self._given, tuning.damp_sp / self._given
        return (tuning.icm, tuning.sp, tuning.tracking, *margins, tuning.damp / self._given * sum(margins))

    def tune(self, numbers: np.ndarray) -> None:
        """Go on with other numbers, of `numbers`."""
        for name, number in zip(TUNED, numbers.tolist(), strict=True):
            self.law[name] = number

    def set_step(self, step: float) -> None:
        """Set the time since the cycle before [s]."""
        self.step = step
        self.law["rate"] = step / RELAXATION_LENGTH
        self.law["period"] = step

    def measure(self, directions: np.ndarray) -> None:
        """Take over the directions in which wheels roll in the world, shape (count, 2)."""
        np.arctan2(directions[:, 1], directions[:, 0], out=self.measured)

    def displace(self, move: PlanarMove) -> None:
        """Remember the base where its estimate has jumped to."""
        move.move(self.before[:2])
        self.before[2] += move.yaw
        self.angles += move.yaw

    def start(self, place: np.ndarray, heading: float, angles: np.ndarray | None = None) -> None:
        """Begin at a place of the base [m] and its heading [rad], at rest.

        Args:
            place: Place of the base, x and y, shape (2,) [m].
            heading: Its heading [rad].
            angles: Directions of the wheels in the world, shape (count,) [rad]; None: they stay what they were.
        """
        if not self.law["across"][0]:
            heading = abs(math.remainder(heading, 2.0 * math.pi))
        self.before[:2] = place
        self.before[2] = heading
        self.wheels["rotation_left"] = 0.0
        if angles is not None:
            self.wheels[:] = np.zeros((), WHEEL_DTYPE)
            for direction in ("angle", "aim", "motion", "error"):
                np.subtract(angles, heading, out=self.wheels[direction])
        self.wheels["desired"] = np.nan
        self.wheels["rate"] = 0.0
