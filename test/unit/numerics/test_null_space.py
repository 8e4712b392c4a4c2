"""Null spaces: A C^T = 0, A A^T = 1, and the numerical rank, against NumPy's SVD."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.errors import SizeMismatch
from solfer.numerics.solvers.null_space import NullSpace

SIZE = 12


def matrices():
    random = np.random.default_rng(3)
    full = random.normal(size=(5, SIZE))
    twice = np.vstack([full, full[1] - 2.0 * full[3]])
    idle = full.copy()
    idle[2] = 0.0
    return {
        "full": (full, 5),
        "dependent": (twice, 5),
        "row of zeros": (idle, 4),
        "zeros": (0.0 * full, 0),
        "none": (np.zeros((0, SIZE)), 0),
        "square": (random.normal(size=(SIZE, SIZE)), SIZE),
    }


@pytest.mark.parametrize("name", matrices())
def test_the_basis_is_orthogonal_to_the_matrix(name):
    matrix, rank = matrices()[name]
    space = NullSpace(SIZE)
    assert space.update(matrix) == rank == space.rank
    assert space.basis.shape == (SIZE - rank, SIZE)
    assert_allclose(space.basis @ matrix.T, 0.0, atol=1e-13)
    assert_allclose(space.basis @ space.basis.T, np.eye(SIZE - rank), atol=1e-13)


def test_projections_agree_with_the_basis():
    random = np.random.default_rng(4)
    space, vector, square = NullSpace(SIZE), random.normal(size=SIZE), random.normal(size=(SIZE, SIZE))
    space.update(random.normal(size=(4, SIZE)))
    out, columns = np.zeros(SIZE), np.zeros((SIZE, SIZE), order="F")
    assert_allclose(space.project(vector, out), space.basis @ vector, atol=1e-13)
    assert_allclose(space.project_columns(square, columns), space.basis @ square, atol=1e-13)
    assert_allclose(space.project_both(square, columns), space.basis @ square @ space.basis.T, atol=1e-13)


def test_constraints_come_and_go():
    random = np.random.default_rng(5)
    space = NullSpace(SIZE)
    for rows in (3, 6, 0, 6):
        matrix = random.normal(size=(rows, SIZE))
        assert space.update(matrix) == rows
        assert_allclose(space.basis @ matrix.T, 0.0, atol=1e-13)


@pytest.mark.parametrize("shape", [(3, SIZE + 1), (SIZE + 1, SIZE), (SIZE,)])
def test_another_shape_is_refused(shape):
    with pytest.raises(SizeMismatch, match=f"{shape}".replace("(", r"\(").replace(")", r"\)")):
        NullSpace(SIZE).update(np.zeros(shape))
