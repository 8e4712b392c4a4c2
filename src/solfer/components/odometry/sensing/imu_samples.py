"""Samples of the IMU: what it measured at any time that lies between two of them."""

import math

import numpy as np

from solfer.components.odometry.sensing import samples_kernel
from solfer.components.odometry.sensing.samples import NO_NUMBERS, SensorHistory, SortedSamples
from solfer.components.odometry.sensing.stamps import StampCheck
from solfer.model.state import State

CAPACITY = 256
"""Samples that are kept of each sensor: half a second of an IMU at 500 Hz."""

ANGLES = slice(0, 3)
"""Numbers of a sample of the IMU: angles of the base [rad]."""

RATES = slice(3, 6)
"""Rates of the angles [rad/s]."""


class ImuSamples:
    """The newest samples of the IMU.

    Args:
        offset: Time by which the IMU's stamps are behind those of the joints [s].
        stamps: Check of its stamps.
        origin: Rotation from the axes of the base's chart to the world, shape (3, 3).

    Attributes:
        stamps: See above.
        sorted: The samples: angles, their rates, and what `samples_kernel` integrates.
        pushed: Change of the velocity of the IMU since the measurement before in the world, by its accelerometer,
            shape (3,) [m/s]; live. NaN: it has none, or samples since then are missing.
        measured_at: Time of the newest measurement [s]; NaN before the first.
        turned: The base's angles at the last measurement, and the newest ones, shape (3,) [rad], of what `turned_since`
            has returned in this cycle; None: not known, or the same.
    """

    def __init__(self, offset: float, stamps: StampCheck, origin: np.ndarray):
        self.stamps = stamps
        self._origin = origin
        self.pushed = np.full(3, math.nan)
        self.turned: tuple[np.ndarray, np.ndarray] | None = None
        self.measured_at = math.nan
        self._offset = offset
        self.sorted = SortedSamples(CAPACITY, 15)
        self._integrals = np.zeros(6)
        self._angles = np.zeros(3)
        self._angles_before = np.zeros(3)

    def start(self) -> None:
        """Begin without samples."""
        self.sorted.clear()
        self.turned = None
        self.measured_at = math.nan
        self.stamps.start()

    def forget_until(self, stamp: float) -> None:
        """Forget the samples up to a stamp [s], and what was measured then."""
        samples = self.sorted
        samples.drop(int(np.searchsorted(samples.stamps[: samples.count], stamp + self._offset, side="right")))
        self.measured_at = math.nan

    def receive(self, history: SensorHistory) -> None:
        """Sort the samples of a cycle in, with the integral of the rates up to each."""
        samples = self.sorted
        messages = history.history
        for index, stamp in history.accepted(self.stamps, -math.inf):
            samples.insert(
                stamp + self._offset,
                NO_NUMBERS,
                messages.values[index],
                history.rows,
                places=history.places,
                force=messages.forces[index],
                origin=self._origin,
            )

    def turned_since(self, time: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the base's angles at the measurement of a time [s], and the newest ones; None: not known."""
        samples = self.sorted
        if self.measured_at != time or not samples.newest > time:
            return None
        return self._angles, samples.rows[samples.count - 1, ANGLES]

    def measure(self, time: float, state: State) -> bool:
        """Write the base's angles at a time [s], and the mean of their rates since they were measured the last time.

        Args:
            time: The time [s].
            state: Where they are written.

        Returns:
            Whether a sample of the IMU is at that time, or samples are on both sides of it.
        """
        samples = self.sorted
        after = int(np.searchsorted(samples.stamps[: samples.count], time))
        before = after if samples.stamps[after] == time else after - 1
        if before < 0:
            return False
        first = samples.rows[before]
        second = samples.rows[after]
        span = float(samples.stamps[after] - samples.stamps[before])
        fraction = (time - float(samples.stamps[before])) / span if span else 0.0
        self._angles_before[:] = self._angles
        for axis in range(3):
            change = math.remainder(second[axis] - first[axis], 2.0 * math.pi)
            self._angles[axis] = first[axis] + fraction * change
        state.position[3:6] = self._angles
        integrals = self._integrals
        integrals_before = integrals.copy()
        samples_kernel.find_turned(samples.stamps, samples.rows, before, after, fraction, integrals)
        passed = time - self.measured_at
        if not passed > 0.0:
            state.velocity[3:6] = first[RATES]
            self.pushed[:] = math.nan
        elif samples.stamps[0] <= self.measured_at:
            state.velocity[3:6] = (integrals[:3] - integrals_before[:3]) / passed
            self.pushed[:] = integrals[3:] - integrals_before[3:]
        else:  # the samples since then are gone, but for their angles
            self.pushed[:] = math.nan
            turned_by = self._angles - self._angles_before
            state.velocity[3:6] = (turned_by - 2.0 * math.pi * np.round(turned_by / (2.0 * math.pi))) / passed
        self.measured_at = time
        kept_time = 0.1  # [s] for measurements of the joints that come late
        samples.drop(max(0, int(np.searchsorted(samples.stamps[: samples.count], time - kept_time)) - 1))
        return True
