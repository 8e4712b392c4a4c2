"""Levels by damped null spaces, against dense matrices: singular ones, rows of zeros, bounds; and their memory."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.allocations import check_that_it_keeps_no_memory
from support.estimation import part

from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.numerics.solvers.damped_descent import DampedDescent

ENDS, SIZE = np.array([0, 6, 9, 9, 13, 17]), 14
COLUMNS = np.array([0, 1, 2, 4, 5, 6, 7, 9, 10, 11, 12, 13])
PERIOD = 0.01  # [s]
levels = part("driving_cases.levels")


def problem(seed, kind):
    """Draw rows, rates and damping; the kinds differ in how the levels contradict each other."""
    random = np.random.default_rng(seed)
    jacobian, rates = random.normal(size=(ENDS[-1], SIZE)), random.normal(size=ENDS[-1])
    jacobian[:, np.setdiff1d(np.arange(SIZE), COLUMNS)] = 0.0
    damping = np.repeat(10.0 ** random.uniform(-2.0, -0.5, len(ENDS) - 1), np.diff(ENDS))
    if kind == "singular":
        jacobian[4] = jacobian[1] - 2.0 * jacobian[2]
        jacobian[7], jacobian[15] = jacobian[0] + 1e-5 * jacobian[7], jacobian[10]
    if kind == "zeros":
        jacobian[[3, 6, 7, 8, 12]] = 0.0
    return jacobian, rates, damping


@pytest.mark.parametrize("kind", ["usual", "singular", "zeros"])
def test_it_computes_its_equations(kind):
    descent = DampedDescent(ENDS, SIZE, COLUMNS)
    for seed in range(20):
        given = problem(seed, kind)
        expected = levels.dense_levels(*given, ENDS, COLUMNS)
        assert_allclose(descent.update(*given), expected, atol=1e-9 * max(1.0, abs(expected).max()), rtol=0.0)
        assert (descent.count, descent.scale) == (0, 1.0)


@pytest.mark.parametrize("kind", ["usual", "singular", "zeros"])
def test_velocities_within_bounds(kind):
    """A dense reference solves the same levels; also where joints are at their ends, or motions must be scaled down."""
    descent, counts, slower = DampedDescent(ENDS, SIZE, COLUMNS), set(), 0
    for seed in range(30):
        random = np.random.default_rng(100 + seed)
        given, speed = problem(seed, kind), random.uniform(0.5, 4.0, SIZE)
        speed[:3], speed[7] = np.inf, 0.0
        ranges = random.uniform(-1.0, 0.0, SIZE), random.uniform(0.0, 1.0, SIZE)
        for end in ranges:
            end[:3] = np.sign(end[:3]) * np.inf
        bounds = VelocityBounds([f"joint_{dof}" for dof in range(SIZE)], *ranges, speed, PERIOD)
        is_at_end = (random.uniform(size=SIZE) < 0.2) & np.isfinite(ranges[1])
        bounds.update(np.where(is_at_end, ranges[1], 0.0))
        expected, count, scale = levels.dense_within(*given, ENDS, COLUMNS, bounds=bounds)
        found = descent.update(*given, bounds)
        assert_allclose(found, expected, atol=1e-9 * max(1.0, abs(expected).max()), rtol=0.0)
        assert descent.count == count and abs(descent.scale - scale) < 1e-9
        assert (found <= bounds.upper + 2e-9).all() and (found >= bounds.lower - 2e-9).all()
        counts.add(count)
        slower += scale < 1.0
    assert len(counts) > 2 and slower > 5


def test_rates_of_zero_stay_zero_when_slower():
    jacobian, rates, damping = problem(1, "usual")
    rates[:6], damping[:6], damping[6:] = 0.0, 1e-7, 0.1
    bounds = VelocityBounds(
        [str(dof) for dof in range(SIZE)], *np.full((2, SIZE), np.inf) * [[-1], [1]], np.full(SIZE, 0.1), PERIOD
    )
    descent = DampedDescent(ENDS, SIZE, COLUMNS)
    assert_allclose(abs(descent.update(jacobian, rates, damping, bounds)).max(), 0.1)
    assert descent.scale < 0.9 and abs(jacobian[:6] @ descent.velocity).max() < 1e-9


@pytest.mark.slow
def test_a_cycle_keeps_no_memory():
    descent, given = DampedDescent(ENDS, SIZE, COLUMNS), problem(2, "usual")
    check_that_it_keeps_no_memory(lambda: descent.update(*given))
