"""How far the base has moved, as most wheels tell it."""

import numpy as np

from solfer.components.odometry import motion_kernel


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
        self.believed = np.ones(count, dtype=bool)

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
        motion_kernel.agree(told, arms, turn, weights, tolerance, self.believed, self.motion, self.rest)

    def mean(self, told: np.ndarray, arms: np.ndarray, turn: float, weights: np.ndarray) -> np.ndarray:
        """Compute the motion by the wheels that are believed, and return it, shape (3,) [m]; live.

        Args:
            told: m, shape (k, 3) [m].
            arms: r, shape (k, 3) [m].
            turn: t [rad].
            weights: Weights of the wheels, shape (k,).
        """
        motion_kernel.mean(told, arms, turn, weights, self.believed, self.motion, self.rest)
        return self.motion
