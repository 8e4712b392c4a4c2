"""The motion that most wheels tell: those that slide count little, as long as others do not."""

import numpy as np

from solfer.components.odometry.agreement import kernel

COMPARED = 0.3
"""Time over which wheels are compared [s]: encoders are too coarse for less."""


class Majority:
    """How far each wheel is from what most of them tell of the velocity over the ground and of the turn.

    A robot on more wheels than it needs presses them against each other. Those that carry little slide, by a hundredth
    of the speed and always the same way, and the others not at all: the mean of all would slide with them. So the
    motion is sought that the most wheels, and the gyroscope, explain within a tolerance. Of the motions of each pair of
    wheels, that one begins which leaves the least sum of log(1 + d^2 / c^2), with distances d and the tolerance c; from
    there reweighting leads to the Cauchy estimator next to it. Source: P. J. Huber and E. M. Ronchetti, "Robust
    Statistics", 2009, chapter 7.

    Args:
        count: Number of wheels k.

    Attributes:
        far: Squared distances d^2, shape (k,) [m^2/s^2]; live.
        shares: How much each wheel counts, of 1 in all, shape (k,); live.
    """

    def __init__(self, count: int):
        self.far, self.shares, self._slow = np.zeros(count), np.zeros(count), np.zeros((count + 1, 2))
        self.start()

    def start(self) -> None:
        """Begin at rest."""
        self.far[:], self._slow[:], self.shares[:] = 0.0, 0.0, 1.0 / len(self.shares)

    def hear(
        self,
        speeds: np.ndarray,
        arms: np.ndarray,
        counted: np.ndarray,
        gyroscope: float,
        unsure: float,
        time: float,
        tolerance: float,
    ) -> float:
        """Take what wheels and the gyroscope tell of a time.

        Args:
            speeds: Velocities that wheels tell, shape (k, 3) [m/s].
            arms: From the base's origin to the contacts, shape (k, 3) [m].
            counted: Which wheels count, shape (k,); fewer than two tell nothing of each other.
            gyroscope: Turn about the vertical [rad/s].
            unsure: Its variance over `COMPARED` [rad^2/s^2].
            time: The time [s].
            tolerance: c^2 [m^2/s^2].

        Returns:
            By how much the turn of the wheels contradicts the gyroscope beyond what is likely [rad^2/s^2].
        """
        keep = COMPARED / (COMPARED + time)
        return float(
            kernel.disagree(
                speeds, arms, counted, gyroscope, unsure, keep, tolerance, self._slow, self.far, self.shares
            )
        )
