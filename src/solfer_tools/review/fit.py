"""The law by which one joint follows another: gain, offset and delay, with their errors."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import ndtri, stdtrit

GAIN = 0
"""Index of the gain."""

OFFSET = 1
"""Index of the offset [rad, m]."""

DELAY = 2
"""Index of the delay [s]."""

NEUTRAL = np.array([1.0, 0.0, 0.0])
"""The law of a joint that does the same."""

BLOCK = 0.15
"""Least duration of a block [s]: longer than what the smoothing ties together."""

CHANCE = 1e-6
"""Probability that noise alone makes a parameter significant."""

LONGEST_DELAY = 0.1
"""Largest delay of a single joint [s]."""


@dataclass(frozen=True)
class Law:
    """`second(t) = gain first(t - delay) + offset`.

    Attributes:
        values: Gain, offset [rad, m] and delay [s].
        limits: How far each has to be from `NEUTRAL` before noise is ruled out; infinite if it was not fitted.
        residual: What the law does not explain, shape (T,) [rad, m].
    """

    values: np.ndarray
    limits: np.ndarray
    residual: np.ndarray


def blocks_of(count: int, step: float) -> np.ndarray:
    """Divide `count` samples into blocks; returns the index of the block of each sample."""
    number = int(np.clip(count * step / BLOCK, 1, 40))  # more of them decide no better
    return np.arange(count) * number // count


def fit(
    curve: CubicSpline, times: np.ndarray, second: np.ndarray, free: tuple[int, ...], noise: float, *, density: float
) -> Law:
    """Fit the law robustly: least squares that are weighted again in each round (Huber), linear in a step of the delay.

    The errors are those of a sandwich over blocks in time (Liang and Zeger 1986), since what is left is not independent
    from one sample to the next, with Student's quantile for their number; and no less than what the noise alone makes.

    Args:
        curve: The first joint over time.
        times: When the second was sampled, on the clock of the first, shape (T,) [s].
        second: The second joint, shape (T,) [rad, m].
        free: The parameters that are fitted; the others stay neutral.
        noise: Standard deviation of the difference [rad, m].
        density: That of a mean of n differences, times the root of n [rad, m].
    """
    values = NEUTRAL.copy()
    chosen = list(free)
    scale = noise
    slope = curve.derivative()
    if GAIN in free:
        values[GAIN] = _first_gain(curve(times), second)
    # standard deviations beyond which residuals count less (Huber 1964): 95 % efficient for Gaussian ones
    huber = 1.345
    for _ in range(12):
        rows, residual = _linear(curve, slope, times, second=second, values=values)
        scale = max(noise, 1.4826 * float(np.median(np.abs(residual))))
        weights = 1.0 / np.maximum(1.0, np.abs(residual) / (huber * scale))
        bread = np.linalg.inv((rows[chosen] * weights) @ rows[chosen].T)
        step = bread @ (rows[chosen] @ (weights * residual))
        values[chosen] += step
        values[DELAY] = np.clip(values[DELAY], -LONGEST_DELAY, LONGEST_DELAY)
        if np.all(np.abs(step) < 1e-5):
            break
    rows, residual = _linear(curve, slope, times, second=second, values=values)
    weights = 1.0 / np.maximum(1.0, np.abs(residual) / (huber * scale))
    limits = np.full(3, np.inf)
    quantile = -float(ndtri(0.5 * CHANCE))  # of the normal distribution
    least = quantile * density * np.sqrt(np.diag(bread))
    limits[chosen] = np.maximum(least, _errors(rows[chosen], weights, residual, bread=bread, times=times))
    return Law(values, limits, residual)


def _first_gain(first: np.ndarray, second: np.ndarray) -> float:
    """Guess the gain with the sign of the motion."""
    first = first - np.mean(first)
    energy = first @ first
    return float(np.copysign(1.0, first @ (second - np.mean(second)))) if energy > 0.0 else 1.0


def _linear(
    curve: CubicSpline, slope: CubicSpline, times: np.ndarray, second: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the law by its parameters, shape (3, T), and what it does not explain, shape (T,)."""
    moments = times - values[DELAY]
    first = curve(moments)
    rows = np.array([first, np.ones_like(first), -values[GAIN] * slope(moments)])
    return rows, second - values[GAIN] * first - values[OFFSET]


@lru_cache
def _quantile(degrees: int) -> float:
    """Return what Student's t exceeds, to either side, with the probability `CHANCE`."""
    return -float(stdtrit(degrees, 0.5 * CHANCE))


def _errors(
    rows: np.ndarray, weights: np.ndarray, residual: np.ndarray, bread: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return how far each parameter may be off by chance."""
    blocks = blocks_of(len(times), float(times[1] - times[0]))
    starts = np.flatnonzero(np.diff(blocks, prepend=-1))
    scores = np.add.reduceat(rows * (weights * residual), starts, axis=1)
    count = len(starts)
    covariance = bread @ (scores @ scores.T) @ bread * count / max(1, count - len(rows))
    return _quantile(max(1, count - len(rows))) * np.sqrt(np.maximum(0.0, np.diag(covariance)))
