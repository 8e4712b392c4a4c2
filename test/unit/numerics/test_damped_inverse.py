"""The damped inverse against NumPy's least squares."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.errors import NotFinite, SizeMismatch
from solfer.numerics.solvers.damped_inverse import DampedInverse


@pytest.mark.parametrize(("rows", "cols"), [(1, 1), (3, 7), (9, 48), (40, 48), (6, 4)])
def test_the_solution_is_the_damped_least_squares_one(rows, cols):
    generator = np.random.default_rng(rows)
    matrix, vector = generator.normal(size=(rows, cols)), generator.normal(size=rows)
    damping = generator.uniform(0.1, 1.0, rows)
    out = np.full(cols, np.nan)
    assert DampedInverse(rows, cols, damping).solve(matrix, vector, out) is out
    # unknowns x, z with the least norm of J x + D z = e
    both = np.linalg.lstsq(np.hstack([matrix, np.diag(damping)]), vector, rcond=None)[0]
    assert_allclose(out, both[:cols], atol=1e-10)


def test_little_damping_gives_the_pseudo_inverse():
    matrix = np.random.default_rng(1).normal(size=(3, 7))
    out = np.zeros(7)
    DampedInverse(3, 7, 1e-6).solve(matrix, np.ones(3), out)
    assert_allclose(out, np.linalg.pinv(matrix) @ np.ones(3), atol=1e-9)
    matrix[2] = matrix[1]
    DampedInverse(3, 7, 0.1).solve(matrix, np.array((0.0, 1.0, -1.0)), out)
    assert np.abs(out).max() < 1e-9
    DampedInverse(3, 7, 0.1).solve(np.full((3, 7), np.nan), np.ones(3), out)
    assert np.isnan(out).all()


def test_what_does_not_fit_is_refused():
    inverse = DampedInverse(3, 7, 0.1)
    with pytest.raises(SizeMismatch, match=r"\(3, 6\).*\(3, 7\)"):
        inverse.solve(np.zeros((3, 6)), np.zeros(3), np.zeros(7))
    with pytest.raises(SizeMismatch, match="not contiguous"):
        inverse.solve(np.zeros((7, 3)).T, np.zeros(3), np.zeros(7))
    with pytest.raises(SizeMismatch, match="3 rows"):
        DampedInverse(3, 7, (0.1, 0.2))
    for damping in (0.0, -1.0, np.nan):
        with pytest.raises(NotFinite):
            DampedInverse(3, 7, damping)
