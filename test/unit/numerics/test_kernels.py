"""Compiled look-ups: they do what NumPy does with the same indices."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from solfer.numerics.kernels import collect, gather, scatter
from solfer.numerics.pointers import address

ROWS, SOURCE, PLACES = np.array([2, 0]), np.array([4, 1, 3]), np.array([0, 3, 1])


@pytest.fixture
def numbers():
    return np.random.default_rng(3).standard_normal((3, 5))


@pytest.fixture
def live():
    return [np.arange(6.0), 10.0 + np.arange(6.0)]


def addresses(arrays):
    return np.array([address(array) for array in arrays], dtype=np.int64)


def test_gathered_numbers_stand_at_their_places(numbers):
    out = np.full((2, 4), 7.0)
    assert gather(numbers, ROWS, SOURCE, PLACES, out) == -1
    expected = np.full((2, 4), 7.0)
    expected[:, PLACES] = numbers[ROWS][:, SOURCE]
    assert_array_equal(out, expected)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_the_first_number_not_finite_is_returned(numbers, wrong):
    numbers[0, 3] = wrong
    assert gather(numbers, ROWS, SOURCE, PLACES, np.zeros((2, 4))) == 5
    numbers[2, 1] = wrong
    assert gather(numbers, ROWS, SOURCE, PLACES, np.zeros((2, 4))) == 1


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


def test_commands_are_collected_from_several_arrays(live):
    out = np.zeros((2, 2))
    collect(addresses(live), np.array([4, 1]), out)
    assert_array_equal(out, [[4.0, 1.0], [14.0, 11.0]])
