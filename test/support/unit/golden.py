"""Golden data that the original program printed for motions given by formulas."""

import gzip
import json
import math
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[3]


def golden(name):
    """Return golden data, and the number of each of its columns by name."""
    data = json.loads(gzip.decompress((ROOT / "test" / "data" / f"{name}.json.gz").read_bytes()))
    return data, {column: index for index, column in enumerate(data["columns"])}


def rolling_legs(posture, t):
    """Return position and velocity of the lower body at a time [s] by the formulas of the odometry's golden data."""
    q, v = np.array(posture, dtype=float), np.zeros(30)
    for leg, first in enumerate(range(6, 30, 6)):
        sign, side, rate = (-1.0 if leg in (1, 2) else 1.0), (1.0 if leg in (0, 2) else -1.0), 0.8 + 0.1 * leg
        q[first + 1] += sign * 0.05 * math.sin(rate * t)
        v[first + 1] = sign * 0.05 * rate * math.cos(rate * t)
        q[first + 2] += sign * 0.04 * math.sin(0.6 * t)
        v[first + 2] = sign * 0.024 * math.cos(0.6 * t)
        q[first + 4] += 0.1 * math.sin(0.5 * t + 0.3 * leg) - 0.1 * math.sin(0.3 * leg)
        v[first + 4] = 0.05 * math.cos(0.5 * t + 0.3 * leg)
        q[first + 5] = side * ((0.6 + 0.05 * leg) * t + 0.3 * math.sin(0.7 * t)) + 0.1 * t
        v[first + 5] = side * ((0.6 + 0.05 * leg) + 0.21 * math.cos(0.7 * t)) + 0.1
    q[3:6] = 0.05 * math.sin(0.9 * t), 0.04 * math.sin(1.1 * t), 0.1 * t
    return q, v
