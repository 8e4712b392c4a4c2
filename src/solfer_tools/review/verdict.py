"""What differs between one joint in two recordings."""

import enum
from dataclasses import dataclass

import numpy as np

from solfer_tools.review.fit import DELAY, GAIN, NEUTRAL, OFFSET, Law


class Difference(enum.Enum):
    """Kinds of differences; the value is the word for people."""

    MISSING = "missing"
    SWAPPED = "swapped"
    NOT_MOVED = "not moved"
    MOVED_ALONE = "moved alone"
    SIGN = "sign"
    GAIN = "gain"
    OFFSET = "offset"
    DELAY = "delay"
    OTHER = "other"


SHAPE_TOLERANCE = 0.02
"""Largest difference that no law explains and that is not one of the motions [rad, m]."""


@dataclass(frozen=True)
class JointVerdict:
    """What was found out about a joint.

    Attributes:
        joint: Its name.
        differences: What differs; empty: nothing that could be evaluated.
        text: The same with numbers, for people.
        since: When it differs first, after the first recording's beginning [s]; NaN if it does not, or is missing.
        largest: Largest difference of the positions [rad, m].
        law: Gain, offset [rad, m] and delay [s] of the second recording against the first, shape (3,); NaN where it
            could not be evaluated.
        limits: Least deviation of each that would have been found, shape (3,); infinite where it was not.
        moves: Whether it moves enough in both for gain, sign and delay to be evaluated.
    """

    joint: str
    differences: tuple[Difference, ...]
    text: str = ""
    since: float = float("nan")
    largest: float = 0.0
    law: np.ndarray | None = None
    limits: np.ndarray | None = None
    moves: bool = False


def findings_of(law: Law, limits: np.ndarray) -> tuple[tuple[Difference, ...], str]:
    """Describe how a law differs from that of a joint that does the same.

    Args:
        law: The law.
        limits: Least deviation of each parameter that counts, shape (3,).
    """
    kinds = []
    texts = []
    gain, offset, delay = law.values
    if gain < 0.0:
        kinds.append(Difference.SIGN)
        texts.append(f"wrong sign (gain {gain:+.3f})")
    if abs(abs(gain) - 1.0) > limits[GAIN]:
        kinds.append(Difference.GAIN)
        texts.append(f"gain {abs(gain):.3f} +- {law.limits[GAIN]:.3f}")
    if abs(offset) > limits[OFFSET]:
        kinds.append(Difference.OFFSET)
        texts.append(f"offset {offset:+.4f} +- {law.limits[OFFSET]:.4f}")
    if abs(delay) > limits[DELAY]:
        kinds.append(Difference.DELAY)
        word = "late" if delay > 0.0 else "early"
        texts.append(f"{word} by {1e3 * abs(delay):.1f} +- {1e3 * law.limits[DELAY]:.1f} ms")
    return tuple(kinds), ", ".join(texts)


def thresholds(law: Law) -> np.ndarray:
    """Return how far each parameter has to be from neutral before it counts, shape (3,): significant and relevant."""
    # gain, offset [rad, m] and delay [s] that two robots of a kind differ by anyway
    return np.maximum((0.03, 0.005, 0.002), law.limits)


def excess(law: Law, free: tuple[int, ...]) -> np.ndarray:
    """Return the deviation of each free parameter in multiples of its threshold; a negative gain is one by its sign."""
    values = np.abs(law.values - NEUTRAL) / thresholds(law)
    return values[list(free)]
