"""Whole revolutions of ways."""

import math

import numpy as np
import pytest

from solfer.numerics.kernels import shorten
from solfer.numerics.rotations import whole_revolutions

REVOLUTIONS = np.array([math.tau, 0.0])


def test_ways_without_whole_revolutions_are_remainders():
    draw = np.random.default_rng(5)
    ways = draw.uniform(-100.0, 100.0, (50, 2))
    expected = [[math.remainder(way, math.tau), other] for way, other in ways]
    assert ways - whole_revolutions(ways, REVOLUTIONS) == pytest.approx(np.array(expected), abs=1e-9)
    shorten(ways, REVOLUTIONS)
    assert ways == pytest.approx(np.array(expected), abs=1e-9)
