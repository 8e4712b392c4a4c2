"""Figures of estimates against the truth."""

import math

import numpy as np


def figures(truth: np.ndarray, estimate: np.ndarray) -> dict[str, float]:
    """Compute what poses x y z heading are worth, shape (T, 4) [m, rad], each seen from its first one."""
    truth, estimate = from_start(truth), from_start(estimate)
    error = estimate - truth
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1))))
    made = {
        "length": way[-1],
        "end_error": np.linalg.norm(error[-1, :2]) / way[-1],
        "height_error": np.abs(error[:, 2]).max(),
        "heading_error": math.degrees(abs(error[-1, 3])),
        "ate": math.sqrt(np.mean(np.sum(error[:, :3] ** 2, axis=1))),
        "rpe_1m": drift(truth, estimate, way, 1.0),
        "rpe_10m": drift(truth, estimate, way, 10.0),
    }
    return {key: float(value) for key, value in made.items() if value is not None}


def from_start(poses: np.ndarray) -> np.ndarray:
    """Return poses x y z heading as seen from the first one."""
    moved = poses - poses[0]
    cosine, sine = math.cos(poses[0, 3]), math.sin(poses[0, 3])
    moved[:, 0], moved[:, 1] = cosine * moved[:, 0] + sine * moved[:, 1], cosine * moved[:, 1] - sine * moved[:, 0]
    moved[:, 3] = np.unwrap(moved[:, 3])
    return moved


def drift(truth: np.ndarray, estimate: np.ndarray, way: np.ndarray, length: float) -> float | None:
    """Return the RMS error of steps of a length [m], each seen from its beginning; None: the way is shorter."""
    ends = np.searchsorted(way, way + length)
    begins = np.flatnonzero(ends < len(way))[::20]
    if not len(begins):
        return None
    steps = []
    for poses in (truth, estimate):
        step, heading = poses[ends[begins], :2] - poses[begins, :2], poses[begins, 3]
        cosine, sine = np.cos(heading), np.sin(heading)
        steps.append(np.stack((cosine * step[:, 0] + sine * step[:, 1], cosine * step[:, 1] - sine * step[:, 0])))
    return math.sqrt(np.mean(np.sum((steps[1] - steps[0]) ** 2, axis=0)))


def normalised(error: np.ndarray, covariance: np.ndarray) -> float:
    """Return the squared error by its covariance, for each dimension: on average 1 if the covariance is right.

    Source: Y. Bar-Shalom, X. R. Li and T. Kirubarajan, "Estimation with Applications to Tracking and Navigation",
    Wiley 2001, section 5.4.

    Args:
        error: Error, shape (n,).
        covariance: Its covariance, shape (n, n).
    """
    return float(error @ np.linalg.solve(covariance, error)) / len(error)
