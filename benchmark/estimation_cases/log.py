"""Logs: what the joints and the base of CENTAURO truly do, from which sensors of any seed measure."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from solfer.simulation import Simulation

ROBOT = Path(__file__).resolve().parents[2] / "config" / "robots" / "centauro"
PERIOD = 0.005
"""Time from a row to the next [s]."""
WHEELS = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))


class Log(NamedTuple):
    """T rows of a drive.

    Attributes:
        time: Simulated time, shape (T,) [s].
        position, velocity, torque: Of the model's DoFs, shape (T, n).
        before: Velocity of the IMU's link at the beginning of the newest step, shape (T, 6) [m/s, rad/s].
        force: Force of the ground on the wheels in the world, shape (T, 4, 3) [N].
        radii: Radii of the wheels, shape (4,) [m].
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray
    before: np.ndarray
    force: np.ndarray
    radii: np.ndarray

    def save(self, path: Path) -> None:
        """Write a file; one that is there is replaced as a whole."""
        part = path.with_suffix(".part.npz")
        np.savez(part, **self._asdict())
        part.rename(path)

    @classmethod
    def load(cls, path: Path) -> "Log":
        """Read what `save` has written."""
        with np.load(path) as arrays:
            return cls(**{name: arrays[name] for name in cls._fields})


class Rows:
    """Rows of a log that grows.

    Args:
        simulation: The robot.
    """

    def __init__(self, simulation: Simulation):
        self._simulation, self._rows = simulation, []

    def take(self) -> None:
        """Append what the robot does now."""
        simulation = self._simulation
        contacts = simulation.contacts()
        force = [contacts.get(wheel, np.zeros(3)) for wheel in WHEELS]
        before = simulation.state.before.velocity("imu_link")
        row = (simulation.time, simulation.q, simulation.v, simulation.torque.astype(np.float32), before, force)
        self._rows.append(tuple(np.array(each) for each in row))

    def log(self, radii: np.ndarray) -> Log:
        """Return all rows."""
        return Log(*(np.array(column) for column in zip(*self._rows, strict=True)), radii=radii)
