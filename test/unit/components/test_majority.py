"""Wheels of which some slide, whose true motion is known: those that do not are found."""

import numpy as np
import pytest

from solfer.components.odometry.agreement.majority import Majority

ARMS = np.array(((0.55, 0.32, -0.6), (0.55, -0.32, -0.6), (-0.55, 0.32, -0.6), (-0.55, -0.32, -0.6)))
ACROSS = np.stack((-ARMS[:, 1], ARMS[:, 0], np.zeros(4)), axis=1)
PERIOD, TOLERANCE, SURE, UNSURE = 0.005, 1e-6, 1e-8, 1e-5
ALL = np.ones(4, dtype=bool)
SLIDES = {1: (-0.002, -0.006), 2: (0.003, -0.001)}  # as of a robot whose legs press against each other [m/s]


def heard(majority, velocity, turn, slides, gyroscope, unsure, cycles=400, counted=ALL):
    """Let wheels tell a motion, some of them besides how they slide [m/s]; return the contradiction."""
    speeds, contradiction = np.array((*velocity, 0.0)) + turn * ACROSS, 0.0
    for wheel, slide in slides.items():
        speeds[wheel, :2] += slide
    for _ in range(cycles):
        contradiction = majority.hear(speeds, ARMS, counted, gyroscope, unsure, PERIOD, TOLERANCE)
    return contradiction


@pytest.mark.parametrize("turn", [0.0, 0.2, -0.4])
@pytest.mark.parametrize("velocity", [(0.3, 0.0), (0.0, -0.2), (0.0, 0.0)])
def test_wheels_that_slide_count_little(velocity, turn):
    majority = Majority(4)
    heard(majority, velocity, turn, SLIDES, turn, SURE)
    assert majority.shares[[0, 3]].sum() > 0.85 and majority.shares.sum() == pytest.approx(1.0)
    slid = [sum(x * x for x in SLIDES[wheel]) for wheel in (1, 2)]
    np.testing.assert_allclose(majority.far[[1, 2]], slid, rtol=0.3)
    assert majority.far[[0, 3]].max() < 0.2 * TOLERANCE


def test_wheels_tell_the_turn_where_the_gyroscope_errs():
    majority = Majority(4)
    contradiction = heard(majority, (0.0, 0.0), 0.0024, {2: (0.002, -0.003)}, 0.0048, UNSURE)
    assert majority.far[[0, 1, 3]].max() < 0.1 * TOLERANCE and contradiction == 0.0


def test_wheels_that_all_turn_contradict_the_gyroscope():
    contradiction = heard(Majority(4), (0.3, 0.0), 0.003, {}, 0.0, SURE)
    assert contradiction == pytest.approx(0.003**2 - 4.0 * SURE, rel=0.01)


def test_one_wheel_contradicts_nobody():
    majority = Majority(4)
    assert heard(majority, (0.3, 0.0), 0.0, SLIDES, 1.0, SURE, counted=ALL & (np.arange(4) == 1)) == 0.0
    assert not majority.far.any() and np.isfinite(majority.shares).all()
