"""Checks of numbers against their bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solfer.numerics.kernels import inside

NUMBERS = st.one_of(st.floats(), st.sampled_from([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan]))


@given(st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), max_size=6))
def test_results_are_those_of_numpy(rows):
    values, lower, upper = (np.array([row[place] for row in rows]) for place in range(3))
    held = np.isfinite(values) & (values >= lower) & (values <= upper)
    assert inside(values, lower, upper) == held.all()


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_outside(wrong):
    free = np.full(3, np.inf)
    assert inside(np.zeros(3), -free, free)
    assert not inside(np.array([0.0, 0.0, wrong]), -free, free)
