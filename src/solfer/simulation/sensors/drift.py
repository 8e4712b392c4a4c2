"""Errors of a sensor that last: white noise of a density, and a bias that is there from the start and wanders."""

import math

import numpy as np

from solfer.simulation.sensors.noise import Noise


class Drift:
    """Noise of a number of axes by its density, which is the same at every rate, and a bias of each axis.

    A sample that stands for the time t has white noise of the deviation `density / sqrt(t)`: its Allan deviation over a
    time T is `density / sqrt(T)`, and that of the bias's random walk `walk sqrt(T / 3)`.

    Source: IEEE Std 952-1997, annex C.

    Args:
        seed: Seed of the robot's noise.
        sensor: Name of the sensor; sensors of different names get independent sequences.
        density: Density of the white noise [unit / sqrt(Hz)].
        bias: Standard deviation of the bias at each start [unit].
        walk: Random walk of the bias [unit / sqrt(s)].
        axes: Number of axes.

    Attributes:
        bias: Present bias, shape (axes,) [unit].
    """

    def __init__(self, seed: int, sensor: str, density: float, bias: float, walk: float, *, axes: int = 3):
        self._noise = Noise(seed, f"drift of {sensor}")
        self._density = density
        self._start = bias
        self._walk = walk
        self.bias = np.zeros(axes)
        self._switch_on()

    def restart(self, seed: int | None = None) -> None:
        """Switch the sensor on again, with the same bias and noise, or those of another seed."""
        self._noise.restart(seed)
        self._switch_on()

    def wander(self, passed: float) -> None:
        """Let the bias walk for a time [s]."""
        self._noise.add(self.bias, self._walk * math.sqrt(passed))

    def add(self, values: np.ndarray, period: float) -> None:
        """Add bias and noise to a sample, shape (axes,), in place, which stands for `period` [s]."""
        values += self.bias
        self._noise.add(values, self.deviation(period))

    def deviation(self, period: float) -> float:
        """Return the standard deviation of the white noise of a sample that stands for `period` [s]."""
        return self._density / math.sqrt(period)

    def _switch_on(self) -> None:
        self.bias[:] = 0.0
        self._noise.add(self.bias, self._start)
