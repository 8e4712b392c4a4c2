"""Whole turns of ways."""

import math

import numpy as np
import pytest

from solfer.numerics.kernels import shorten
from solfer.numerics.rotations import whole_turns

TURNS = np.array([math.tau, 0.0])


def test_ways_without_whole_turns_are_remainders():
    draw = np.random.default_rng(5)
    ways = draw.uniform(-100.0, 100.0, (50, 2))
    expected = [[math.remainder(way, math.tau), other] for way, other in ways]
    assert ways - whole_turns(ways, TURNS) == pytest.approx(np.array(expected), abs=1e-9)
    shorten(ways, TURNS)
    assert ways == pytest.approx(np.array(expected), abs=1e-9)
