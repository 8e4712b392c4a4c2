"""Wheels of which some slide, whose true motion is known: those that do not are found."""

import numpy as np
import pytest

from solfer.components.odometry.consensus import WheelConsensus, yaw_of

ARMS = np.array(((0.55, 0.32, -0.6), (0.55, -0.32, -0.6), (-0.55, 0.32, -0.6), (-0.55, -0.32, -0.6)))
ACROSS = np.stack((-ARMS[:, 1], ARMS[:, 0], np.zeros(4)), axis=1)
PERIOD, TOLERANCE, SURE, UNSURE = 0.005, 1e-6, 1e-8, 1e-5
ALL = np.ones(4, dtype=bool)
SLIDES = {1: (-0.002, -0.006), 2: (0.003, -0.001)}  # as of a robot whose legs press against each other [m/s]


def compare(consensus, velocity, turn, slides, rate, variance, inliers=ALL):
    """Let wheels measure a motion, some of them besides how they slide [m/s]; return contradiction and weights."""
    speeds = np.array((*velocity, 0.0)) + turn * ACROSS
    for wheel, slide in slides.items():
        speeds[wheel, :2] += slide
    consensus.inliers[:] = inliers
    for _ in range(400):
        variances = np.ones(4)
        contradiction = consensus.compare(
            speeds, ARMS, rate, variance, tolerance=TOLERANCE, time=PERIOD, variances=variances
        )
    return contradiction, 1.0 / variances


@pytest.mark.parametrize("turn", [0.0, 0.2, -0.4])
@pytest.mark.parametrize("velocity", [(0.3, 0.0), (0.0, -0.2), (0.0, 0.0)])
def test_wheels_that_slide_count_little(velocity, turn):
    consensus = WheelConsensus(4)
    _, weights = compare(consensus, velocity, turn, SLIDES, turn, SURE)
    assert weights[[0, 3]].sum() > 0.97 * weights.sum()
    slid = [sum(x * x for x in SLIDES[wheel]) for wheel in (1, 2)]
    np.testing.assert_allclose(consensus.distances[[1, 2]], slid, rtol=0.3)
    assert consensus.distances[[0, 3]].max() < 0.2 * TOLERANCE


def test_wheels_that_all_slide_still_count():
    """However far each is from the others: the filter would not come back from a velocity that nothing corrects."""
    slides = {0: (0.3, 0.1), 1: (-0.2, 0.4), 2: (0.4, -0.3), 3: (-0.5, -0.2)}
    _, weights = compare(WheelConsensus(4), (0.1, 0.0), 0.0, slides, 0.0, SURE)
    assert weights.min() == 1e-4


def test_wheels_measure_the_turn_where_the_gyroscope_errs():
    consensus = WheelConsensus(4)
    contradiction, _ = compare(consensus, (0.0, 0.0), 0.0024, {2: (0.002, -0.003)}, 0.0048, UNSURE)
    assert consensus.distances[[0, 1, 3]].max() < 0.1 * TOLERANCE and contradiction == 0.0


def test_wheels_that_all_turn_contradict_the_gyroscope():
    contradiction, _ = compare(WheelConsensus(4), (0.3, 0.0), 0.003, {}, 0.0, SURE)
    assert contradiction == pytest.approx(0.003**2 - 4.0 * SURE, rel=0.01)


def test_one_wheel_contradicts_no_other():
    consensus = WheelConsensus(4)
    contradiction, weights = compare(consensus, (0.3, 0.0), 0.0, SLIDES, 1.0, SURE, inliers=np.arange(4) == 1)
    assert contradiction == 0.0 and not consensus.distances.any() and (weights == 1.0).all()


@pytest.mark.parametrize("wheel", range(4))
def test_a_wheel_that_slips_is_rejected(wheel):
    """The worst one is left out, in a turn as well; the others stay."""
    speeds = np.array((0.3, 0.1, 0.0)) + 0.4 * ACROSS
    speeds[wheel, 0] += 0.1
    consensus = WheelConsensus(4)
    for _ in range(20):
        consensus.reject(speeds, ARMS, 0.4, np.ones(4), tolerance=0.06, time=PERIOD)
    np.testing.assert_array_equal(consensus.inliers, np.arange(4) != wheel)


def test_the_turn_of_wheels_is_that_of_their_ways():
    turn, spread = yaw_of(0.01 * ACROSS + (0.2, -0.1, 0.0), ARMS, np.ones(4))
    assert turn == pytest.approx(0.01) and spread == pytest.approx(0.55**2 + 0.32**2)


def test_intervals_that_differ_reject_no_wheel():
    """A robot that turns faster and faster: messages that are lost make intervals longer, and no wheel slips."""
    consensus, time = WheelConsensus(4), 0.0
    for index in range(200):
        interval = PERIOD * (1 + index % 4)
        time += interval
        rate = 2.0 * (time - 0.5 * interval)
        speeds = np.array((0.3, 0.0, 0.0)) + rate * ACROSS
        consensus.reject(speeds, ARMS, rate, np.ones(4), tolerance=0.03, time=interval)
        assert consensus.inliers.all()
