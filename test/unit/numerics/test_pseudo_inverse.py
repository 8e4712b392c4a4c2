"""Pseudo-inverses of symmetric matrices, against NumPy's."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.errors import NotFinite
from solfer.numerics.solvers.pseudo_inverse import SymmetricPseudoInverse


@pytest.mark.parametrize("rank", range(7))
def test_of_every_rank_it_is_that_of_numpy(rank):
    inverse = SymmetricPseudoInverse(6)
    for seed in range(20):
        half = np.random.default_rng(seed).normal(size=(6, rank))
        inverse.matrix[:] = half @ half.T
        expected = np.linalg.pinv(inverse.matrix, rcond=1e-10, hermitian=True)
        value = inverse.update()
        assert inverse.rank == rank
        assert value is inverse.value
        assert_allclose(value, expected, rtol=0.0, atol=1e-9 * max(1.0, np.abs(expected).max()))


def test_rows_of_zeros_count_for_nothing():
    inverse = SymmetricPseudoInverse(3)
    inverse.matrix[:] = np.diag((4.0, 0.0, 2.0))
    assert_allclose(inverse.update(), np.diag((0.25, 0.0, 0.5)))
    assert inverse.rank == 2


def test_what_is_not_finite_is_refused():
    inverse = SymmetricPseudoInverse(2)
    for wrong in (np.nan, np.inf):
        inverse.matrix[:] = ((1.0, wrong), (wrong, 1.0))
        with pytest.raises(NotFinite):
            inverse.update()
