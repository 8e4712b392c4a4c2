"""Motions through points: what they go through, how smooth they are, and what they never exceed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.numerics.via_points import ViaPoints

TIMES = np.array([0.0, 0.5, 0.8, 2.0])
RNG = np.random.default_rng(3)
POSITIONS, VELOCITIES, ACCELERATIONS = (RNG.uniform(-1.0, 1.0, (4, 3)) for _ in range(3))
GIVEN = {
    "linear": (POSITIONS,),
    "cubic": (POSITIONS, VELOCITIES),
    "quintic": (POSITIONS, VELOCITIES, ACCELERATIONS),
}


def sampled(motion, times):
    """Return positions and velocities at times, shape (len(times), n)."""
    rows = []
    for time in times:
        position, velocity = np.zeros(3), np.zeros(3)
        motion.at(time, position, velocity)
        rows.append((position, velocity))
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


@pytest.mark.parametrize("kind", GIVEN)
def test_points_are_passed_as_given(kind):
    given = GIVEN[kind]
    positions, velocities = sampled(ViaPoints(TIMES, *given), TIMES[:-1])
    assert_allclose(positions, POSITIONS[:-1], atol=1e-12)
    if kind != "linear":
        assert_allclose(velocities, VELOCITIES[:-1], atol=1e-12)
    before, slow = sampled(ViaPoints(TIMES, *given), TIMES[1:] - 1e-9)
    assert_allclose(before, POSITIONS[1:], atol=1e-7)
    if kind != "linear":
        assert_allclose(slow, VELOCITIES[1:], atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", GIVEN)
def test_velocities_are_the_derivative(kind):
    times = np.arange(0.0, 2.0, 1e-4)
    positions, velocities = sampled(ViaPoints(TIMES, *GIVEN[kind]), times)
    inner = np.all(np.abs(times[1:-1, None] - TIMES) > 2e-4, axis=1)
    slope = (positions[2:] - positions[:-2]) / 2e-4
    assert_allclose(slope[inner], velocities[1:-1][inner], atol=1e-5)


def test_accelerations_of_a_quintic_are_met():
    h = 1e-5
    _, velocities = sampled(ViaPoints(TIMES, *GIVEN["quintic"]), np.ravel([TIMES[:-1], TIMES[:-1] + h], order="F"))
    assert_allclose((velocities[1::2] - velocities[::2]) / h, ACCELERATIONS[:-1], atol=1e-2)


def test_the_end_is_at_rest():
    positions, velocities = sampled(ViaPoints(TIMES, POSITIONS, VELOCITIES), [2.0, 9.0])
    assert_allclose(positions, [POSITIONS[-1]] * 2)
    assert not velocities.any()


@pytest.mark.parametrize("kind", GIVEN)
def test_extremes_hold_for_the_whole_motion(kind):
    motion = ViaPoints(TIMES, *GIVEN[kind])
    lowest, highest, fastest = motion.extremes()
    positions, velocities = sampled(motion, np.arange(0.0, 2.0, 1e-3))
    assert_allclose(lowest, positions.min(axis=0), atol=0.03)
    assert_allclose(highest, positions.max(axis=0), atol=0.03)
    assert_allclose(fastest, np.abs(velocities).max(axis=0), rtol=0.05)
