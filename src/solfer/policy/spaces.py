"""Spaces of observations and actions: those of Gymnasium if it is installed, else boxes with the same attributes."""

import importlib
from importlib.util import find_spec
from typing import Any

import numpy as np


class Box:
    """Numbers between bounds, with the attributes of Gymnasium's class of this name.

    Args:
        low, high: Bounds of all numbers.
        shape: Shape of the numbers.

    Attributes:
        low, high: Bounds, of that shape.
        shape: See above.
        dtype: Type of the numbers.
    """

    dtype = np.dtype(np.float32)

    def __init__(self, low: float, high: float, shape: tuple[int, ...]):
        self.low = np.full(shape, low, dtype=np.float32)
        self.high = np.full(shape, high, dtype=np.float32)
        self.shape = shape
        self._random = np.random.default_rng()

    def seed(self, seed: int | None = None) -> None:
        """Begin samples again."""
        self._random = np.random.default_rng(seed)

    def sample(self) -> np.ndarray:
        """Draw numbers between the bounds."""
        return self._random.uniform(self.low, self.high).astype(np.float32)

    def contains(self, numbers: np.ndarray) -> bool:
        """Return whether numbers have the shape and are between the bounds."""
        return np.shape(numbers) == self.shape and bool(np.all((numbers >= self.low) & (numbers <= self.high)))


def box(count: int, bound: float) -> Any:
    """Make the space of `count` numbers from -bound to bound."""
    if find_spec("gymnasium") is None:
        return Box(-bound, bound, (count,))
    return importlib.import_module("gymnasium").spaces.Box(-bound, bound, (count,), np.float32)
