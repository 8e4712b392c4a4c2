"""Robust consensus of wheels: which of them slip, and how far each is from what most of them measure."""

import math

import numpy as np

from solfer.components.odometry import consensus_kernel as kernel
from solfer.numerics.blocks import MemoryBlock

COMPARISON_TIME = 0.3
"""Time over which wheels are compared [s]: encoders are too coarse for less."""


class WheelConsensus:
    """Finds wheels that slip, and weighs those that slide a little.

    Wheel i at r_i measures the base's velocity v + yaw_rate z x r_i, wherever it rolls without slip.

    Slip is fast: the worst wheel is left out while it is further than a tolerance from the mean of the others.

    Sliding is slow. A robot on more wheels than it needs presses them against each other; those that carry little slide
    by a hundredth of the speed, always the same way, and their mean would slide with them. So the twist is sought that
    minimises the sum of log(1 + d^2 / c^2) over wheels, with distances d and a tolerance c, and over the gyroscope's
    rate: the Cauchy M-estimator. It begins from the best twist of each pair of wheels, as MLESAC does, and goes on by
    iterative reweighting. Sources: P. J. Huber and E. M. Ronchetti, "Robust Statistics", 2009, chapter 7; P. H. S. Torr
    and A. Zisserman, "MLESAC", CVIU 78, 2000.

    Args:
        count: Number of wheels k.
        slip_time: Time over which wheels are compared that slip [s].

    Attributes:
        inliers: Which wheels do not slip, shape (k,); live.
        distances: Squared distances d^2, shape (k,) [m^2/s^2]; live.
        contradiction: By how much the yaw rate of the wheels contradicts the gyroscope [rad/s].
        contradicted: For how long that has been more than 0.1 rad/s [s].
    """

    def __init__(self, count: int, slip_time: float = 0.02):
        self.inliers = np.ones(count, dtype=bool)
        self.distances = np.zeros(count)
        self.contradiction = self.contradicted = 0.0
        self._slip_time = slip_time
        self._recent = np.zeros((count + 1, 3))
        self._speeds = np.zeros((count + 1, 2))
        self._block = MemoryBlock(
            kernel.CONSENSUS,
            count=count,
            inliers=self.inliers,
            distances=self.distances,
            recent=self._recent,
            speeds=self._speeds,
            weights=np.zeros(count),
            mean=np.zeros(3),
        )

    def start(self) -> None:
        """Begin at rest."""
        self.inliers[:] = True
        self.contradiction = self.contradicted = 0.0
        for numbers in (self.distances, self._recent, self._speeds):
            numbers[:] = 0.0

    def reject(
        self, speeds: np.ndarray, arms: np.ndarray, rate: float, weights: np.ndarray, *, tolerance: float, time: float
    ) -> None:
        """Find out which wheels slip; two are left in any case.

        Args:
            speeds: What wheels measure of the base's velocity, shape (k, 3) [m/s].
            arms: r, shape (k, 3) [m].
            rate: Yaw rate [rad/s].
            weights: Weights of the wheels, shape (k,); at least two are positive.
            tolerance: How far a wheel may be from the others [m/s].
            time: Time of these speeds [s].
        """
        keep = self._slip_time / (self._slip_time + time)
        kernel.reject(self._block.address, speeds, arms, rate, weights, tolerance, keep)

    def compare(
        self,
        speeds: np.ndarray,
        arms: np.ndarray,
        rate: float,
        variance: float,
        *,
        tolerance: float,
        time: float,
        variances: np.ndarray,
    ) -> float:
        """Compute distances from the Cauchy estimate, and let wheels count by them.

        Args:
            speeds: What wheels measure of the base's velocity, shape (k, 3) [m/s].
            arms: r, shape (k, 3) [m].
            rate: Yaw rate that the gyroscope measures [rad/s].
            variance: Its variance over `COMPARISON_TIME` [rad^2/s^2].
            tolerance: c^2 [m^2/s^2].
            time: Time of these speeds [s].
            variances: Variances of the speeds, shape (k,); are multiplied by (1 + d^2 / c^2)^2, up to a bound.

        Returns:
            By how much the yaw rate of the wheels contradicts the gyroscope beyond what is likely [rad^2/s^2].
        """
        keep = COMPARISON_TIME / (COMPARISON_TIME + time)
        address = self._block.address
        contradiction = kernel.estimate(address, speeds, arms, rate, variance, keep, tolerance, variances)
        self.contradiction = math.sqrt(max(contradiction, 0.0))
        self.contradicted = self.contradicted + time if self.contradiction > 0.1 else 0.0
        return contradiction


def yaw_of(displacements: np.ndarray, arms: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
    """Compute the yaw that wheels measure [rad], and the mean square of their arms [m^2].

    Args:
        displacements: What wheels measure of the base's displacement, shape (k, 3) [m].
        arms: From the base's origin to the contacts, shape (k, 3) [m].
        weights: Weights, shape (k,); at least two are positive.
    """
    yaw, spread = kernel.yaw(displacements, arms, weights)
    return float(yaw), float(spread)
