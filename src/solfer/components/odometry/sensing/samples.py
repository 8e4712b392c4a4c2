"""The newest samples of a sensor, in the order of their stamps."""

import math

import numpy as np

from solfer.components.odometry.sensing import samples_kernel
from solfer.components.odometry.sensing.stamps import StampCheck
from solfer.model.history import History
from solfer.robot import Robot

NO_NUMBERS = np.zeros(0)
NO_VALUES = np.zeros((0, 0))
NO_PLACES = np.zeros(0, dtype=np.int64)


class SortedSamples:
    """The newest samples of a sensor, in the order of their stamps.

    Args:
        capacity: Largest number of samples; the oldest is dropped for a new one.
        width: Numbers of a sample.

    Attributes:
        count: Number of samples.
        stamps: Their stamps, shape (capacity,) [s].
        rows: Their numbers, shape (capacity, width).
        newest: Stamp of the newest sample [s]; minus infinity without one.
    """

    def __init__(self, capacity: int, width: int):
        self.stamps = np.zeros(capacity)
        self.rows = np.zeros((capacity, width))
        self.clear()

    def clear(self) -> None:
        """Forget all samples."""
        self.count = 0
        self.newest = -math.inf

    def insert(
        self,
        stamp: float,
        known: np.ndarray = NO_NUMBERS,
        values: np.ndarray = NO_VALUES,
        which: np.ndarray = NO_PLACES,
        *,
        places: np.ndarray = NO_PLACES,
        force: np.ndarray = NO_NUMBERS,
        origin: np.ndarray = NO_VALUES,
    ) -> int:
        """Insert a sample; return its row, or -1 where there is one with that stamp, or it is too old.

        Args:
            stamp: Its stamp [s].
            known: Numbers with which it begins, which count where a message lacks some.
            values: Numbers of its message, one row for each interface.
            which: `SensorHistory.rows`, those of `values` that it has.
            places: `SensorHistory.places`, where they belong.
            force: Specific force of a sample of an IMU, shape (3,) [m/s^2], see `samples_kernel`; empty: it is none.
            origin: Rotation from the axes of the base's chart to the world, shape (3, 3).
        """
        row = samples_kernel.insert(
            self.stamps, self.rows, self.count, stamp, known, values, which, places, force, origin,
        )  # fmt: skip
        if row >= 0:
            self.count = min(self.count + 1, len(self.stamps))
            self.newest = max(self.newest, stamp)
        return row

    def drop(self, number: int) -> None:
        """Forget the oldest samples, so many of them."""
        if not number:
            return
        if number >= self.count:
            self.clear()
            return
        self.count -= number
        self.stamps[: self.count] = self.stamps[number : self.count + number]
        self.rows[: self.count] = self.rows[number : self.count + number]


class SensorHistory:
    """A history of positions and velocities of certain DoFs, in their order.

    Args:
        history: The history.
        first: The first of these DoFs, which follow each other.

    Attributes:
        history: See above.
        places: Places of its DoFs among them, shape (k,).
        rows: Rows of its values that are positions and velocities, shape (2,).
    """

    def __init__(self, history: History, first: int):
        self.history = history
        self.places = np.array(history.dofs - first, dtype=np.int64)
        self.rows = np.array([history.interfaces.index(name) for name in ("position", "velocity")], dtype=np.int64)

    @classmethod
    def find(cls, robot: Robot, dofs: range) -> "SensorHistory | None":
        """Find the history of all DoFs of a range; None: no pipe has one."""
        for history in robot.state.histories:
            if {"position", "velocity"} <= set(history.interfaces) and sorted(history.dofs.tolist()) == list(dofs):
                return cls(history, dofs.start)
        return None

    def accepted(self, check: StampCheck, after: float) -> list[tuple[int, float]]:
        """List the rows of this cycle whose stamps pass a check and are after a time [s]: row and stamp [s]."""
        history = self.history
        accepted: list[tuple[int, float]] = []
        for index in range(history.count):
            stamp = round(float(history.stamps[index]), 6)  # whatever a transport has rounded: they are alike then
            if check.accepts(stamp, float(history.arrivals[index]), after, history.sender):
                accepted.append((index, stamp))
        return accepted

    def copy(self, index: int, out: np.ndarray) -> None:
        """Copy a row: all positions, then all velocities; what it lacks stays as it is."""
        samples_kernel.copy(self.history.values[index], self.rows, self.places, out)
