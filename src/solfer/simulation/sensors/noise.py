"""Noise that repeats itself."""

import zlib

import numpy as np


class Noise:
    """White Gaussian noise of one sensor; equal seeds give equal sequences.

    Args:
        seed: Seed of the robot's noise.
        sensor: Name of the sensor; sensors of different names get independent sequences.
    """

    def __init__(self, seed: int, sensor: str):
        self._key = (seed, zlib.crc32(sensor.encode()))
        self.restart()

    def restart(self, seed: int | None = None) -> None:
        """Begin the sequence again, or that of another seed."""
        self._generator = np.random.default_rng(self._key if seed is None else (seed, self._key[1]))

    def add(self, values: np.ndarray, deviation: float) -> None:
        """Add noise of a standard deviation to `values` in place; zero draws nothing."""
        if deviation:
            values += deviation * self._generator.standard_normal(len(values))

    def spread(self, values: np.ndarray, largest: float) -> None:
        """Write numbers that are equally likely between -largest and largest; zero draws nothing."""
        values[:] = self._generator.uniform(-largest, largest, len(values)) if largest else 0.0
