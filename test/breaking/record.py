"""The joint states that a robot published, in its own time."""

import time
from typing import NamedTuple

import numpy as np


class Samples(NamedTuple):
    """Joints over time.

    Attributes:
        times: The robot's own time, shape (k,) [s].
        positions: Shape (k, joints) [rad].
        velocities: Shape (k, joints) [rad/s].
        arrivals: When they came, by the clock of the machine, without the time in which the robot was stopped on
            purpose, shape (k,) [s].
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    arrivals: np.ndarray


class Record:
    """Records joint states, from any thread.

    Attributes:
        joints: Names of the joints.
        robots: How often a robot has begun anew: its time went back.
        stopped: For how long the robot was stopped on purpose [s].
    """

    def __init__(self) -> None:
        self.joints: tuple[str, ...] = ()
        self.robots, self.stopped = 0, 0.0
        self._published: list[tuple[int, float, np.ndarray, np.ndarray, float]] = []

    def add(self, stamp: float, joints: tuple[str, ...], positions: np.ndarray, velocities: np.ndarray) -> None:
        """Record one sample; arrays have to be the record's own."""
        self.joints = joints
        if self._published and stamp < self._published[-1][1]:
            self.robots += 1
        self._published.append((self.robots, stamp, positions, velocities, time.monotonic() - self.stopped))

    def forget(self) -> None:
        """Forget all but the newest sample."""
        del self._published[:-1]

    def __bool__(self) -> bool:
        return bool(self._published)

    @property
    def time(self) -> float:
        """The robot's time [s]."""
        return self._published[-1][1]

    def position(self, joint: str) -> float:
        """Return the newest position of a joint [rad]."""
        return float(self._published[-1][2][self.joints.index(joint)])

    def velocity(self, joint: str) -> float:
        """Return the newest velocity of a joint [rad/s]."""
        return float(self._published[-1][3][self.joints.index(joint)])

    def samples(self, robot: int) -> Samples:
        """Return all samples of one robot, which are one or more."""
        published = [sample for number, *sample in list(self._published) if number == robot]
        return Samples(*map(np.array, zip(*published, strict=True)))
