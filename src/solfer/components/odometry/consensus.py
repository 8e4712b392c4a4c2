"""How far the base has moved, as most wheels tell it."""

import numpy as np


class Consensus:
    """The motion d of the base that explains what wheels tell, without those that contradict the others.

    Wheel i, at r_i from the base, tells m_i = d + t n x r_i, where t is the turn about the vertical n. Means are
    weighted.

    Args:
        count: Number of wheels k.

    Attributes:
        motion: d, shape (3,) [m]; live.
        rest: m_i - d - t n x r_i of each wheel, shape (k, 3) [m]; live.
        believed: Which wheels contradict the others the least, shape (k,).
    """

    def __init__(self, count: int):
        self.motion, self.rest = np.zeros(3), np.zeros((count, 3))
        self.believed, self._told = np.ones(count, dtype=bool), np.zeros((count, 3))
        self._weights, self._distances = np.ones(count), np.zeros(count)

    def turn(self, told: np.ndarray, arms: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
        """Compute the turn about the vertical that wheels tell.

        Args:
            told: m, shape (k, 3) [m].
            arms: r, shape (k, 3) [m].
            weights: Weights, shape (k,); at least two are positive.

        Returns:
            The turn [rad], and the sum of weights times squared distances from their mean [m^2].
        """
        total = weights.sum()
        arm, mean = weights @ arms / total, weights @ told / total
        x, y = arms[:, 0] - arm[0], arms[:, 1] - arm[1]
        spread = float(weights @ (x * x + y * y))
        across = x * (told[:, 1] - mean[1]) - y * (told[:, 0] - mean[0])
        return (float(weights @ across) / spread if spread > 0.0 else 0.0), spread

    def agree(self, told: np.ndarray, arms: np.ndarray, turn: float, weights: np.ndarray, tolerance: float) -> None:
        """Find out which wheels are believed.

        While the worst wheel is further than a tolerance from what the others tell, it is left out; two wheels are left
        in any case.

        Args:
            told: See `mean`.
            arms: See `mean`.
            turn: See `mean`.
            weights: See `mean`.
            tolerance: How far a wheel may be from the others [m].
        """
        np.greater(weights, 0.0, out=self.believed)
        self.mean(told, arms, turn, weights)
        while np.count_nonzero(self.believed) > 2 and self._leave_out(tolerance):
            self.mean(told, arms, turn, weights)

    def mean(self, told: np.ndarray, arms: np.ndarray, turn: float, weights: np.ndarray) -> np.ndarray:
        """Compute the motion by the wheels that are believed, and return it, shape (3,) [m]; live.

        Args:
            told: m, shape (k, 3) [m].
            arms: r, shape (k, 3) [m].
            turn: t [rad].
            weights: Weights of the wheels, shape (k,).
        """
        self._told[:] = told
        self._told[:, 0] += turn * arms[:, 1]
        self._told[:, 1] -= turn * arms[:, 0]
        np.multiply(weights, self.believed, out=self._weights)
        np.dot(self._weights, self._told, out=self.motion)
        self.motion /= self._weights.sum()
        np.subtract(self._told, self.motion, out=self.rest)
        return self.motion

    def _leave_out(self, tolerance: float) -> bool:
        """Leave the wheel out that contradicts the others most; False if none is beyond the tolerance."""
        np.einsum("ij,ij->i", self.rest, self.rest, out=self._distances)
        # the wheel itself pulls the mean: without it, it would be further away
        total = self._weights.sum()
        self._distances *= self.believed * (total / np.maximum(total - self._weights, 1e-12)) ** 2
        worst = int(np.argmax(self._distances))
        if self._distances[worst] <= tolerance * tolerance:
            return False
        self.believed[worst] = False
        return True
