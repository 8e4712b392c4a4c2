"""Velocity bounds: where a joint may go, near the end of its range and outside it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.errors import ConfigError, NotFinite, SizeMismatch
from solfer.numerics.bounds.velocity import VelocityBounds

JOINTS = ("shoulder", "elbow", "wheel")
LOWER, UPPER, SPEED = np.array((-1.0, 0.0, -np.inf)), np.array((2.0, 0.5, np.inf)), np.array((3.0, 1.0, np.inf))
HORIZON = 0.1  # [s]


def bounds(position, horizon=HORIZON):
    made = VelocityBounds(JOINTS, LOWER, UPPER, SPEED, horizon)
    made.update(np.array(position))
    return made.lower, made.upper


def test_bounds_shrink_towards_the_end_of_range():
    lower, upper = bounds((1.9, 0.25, 7.0))
    assert_allclose(lower, (-3.0, -1.0, -np.inf))
    assert_allclose(upper, (1.0, 1.0, np.inf))
    lower, upper = bounds((2.0, 0.02, 0.0))
    assert_allclose(lower, (-3.0, -0.2, -np.inf))
    assert_allclose(upper, (0.0, 1.0, np.inf))


@pytest.mark.parametrize("position", [(2.5, -0.2, 0.0), (-9.0, 0.7, 0.0)])
def test_a_joint_outside_may_only_come_back(position):
    lower, upper = bounds(position)
    for index in (0, 1):
        out = np.sign(position[index] - 0.1)
        away, back = (upper, -lower) if out > 0 else (-lower, upper)
        assert away[index] == 0.0
        assert back[index] == SPEED[index]


def test_zero_velocity_is_always_allowed():
    made, random = VelocityBounds(JOINTS, LOWER, UPPER, SPEED, HORIZON), np.random.default_rng(0)
    for _ in range(1000):
        position = random.uniform(-3.0, 3.0, 3)
        made.update(position)
        assert (made.lower <= 0.0).all() and (made.upper >= 0.0).all()
        inside = (LOWER <= position) & (position <= UPPER)
        for bound in (made.lower, made.upper):
            reached = (position + HORIZON * bound)[inside]
            assert (reached >= LOWER[inside] - 1e-12).all() and (reached <= UPPER[inside] + 1e-12).all()


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        (
            {"lower_position": (3.0, 0.0, 0.0)},
            ConfigError,
            r"joint 'shoulder': the lower limit 3 is above the upper one 2",
        ),
        ({"speed": (1.0, -1.0, 1.0)}, ConfigError, "joint 'elbow': a largest speed of -1"),
        ({"upper_position": (2.0, 0.5, np.nan)}, NotFinite, "joint 'wheel': a limit is not a number"),
        ({"speed": (1.0, 1.0)}, SizeMismatch, r"shape \(2,\) for 3 joints"),
        ({"horizon": 0.0}, ConfigError, "a horizon of 0 s"),
        ({"horizon": np.nan}, ConfigError, "a horizon of nan s"),
    ],
)
def test_limits_that_contradict_each_other_are_refused(change, error, text):
    arguments = {"joints": JOINTS, "lower_position": LOWER, "upper_position": UPPER, "speed": SPEED, "horizon": HORIZON}
    with pytest.raises(error, match=text):
        VelocityBounds(**{**arguments, **change})
