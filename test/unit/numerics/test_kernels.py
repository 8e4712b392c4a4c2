"""Compiled look-ups: they do what NumPy does with the same indices."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from solfer.numerics.kernels import scatter
from solfer.numerics.pointers import address


@pytest.fixture
def live():
    return [np.arange(6.0), 10.0 + np.arange(6.0)]


def addresses(arrays):
    return np.array([address(array) for array in arrays], dtype=np.int64)


def test_scattered_values_are_found_where_they_change(live):
    dofs, values = np.array([5, 0, 2]), np.zeros((2, 3))
    values[0], values[1] = live[0][dofs], live[1][dofs]
    everything = np.arange(3)
    assert scatter(dofs, addresses(live), values, everything) == 0
    values[1, 2] += 1.0
    assert scatter(dofs, addresses(live), values, everything) == 2
    assert_array_equal(live[1], [10.0, 11.0, 13.0, 13.0, 14.0, 15.0])
    values += 1.0
    assert scatter(dofs, addresses(live), values, np.array([1])) == 3
    assert_array_equal(live[0], [1.0, 1.0, 2.0, 3.0, 4.0, 5.0])
