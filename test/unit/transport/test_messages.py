"""Numbers of messages: where they lie, and whose they are."""

from copy import deepcopy

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from solfer.transport.messages import JointMessage, PointsMessage, arrays, copied

FIELDS = ("position", "effort", "load")


@pytest.fixture
def message():
    message = JointMessage.empty(("a", "b"), FIELDS)
    message.block[:] = np.arange(6.0).reshape(3, 2)
    return message


def test_fields_are_rows_of_one_array(message):
    assert message.rows == FIELDS
    for row, field in enumerate(FIELDS):
        assert_array_equal(message.numbers(field), message.block[row])
        assert np.shares_memory(message.numbers(field), message.block)
    assert arrays(message) == (message.block,)


def test_an_array_in_the_place_of_a_row_is_what_is_sent(message):
    """Numbers that are changed in place stay rows of the one array; others lie apart from then on."""
    message.effort += 1.0
    assert np.shares_memory(message.effort, message.block)
    message.effort = np.array((7.0, 8.0))
    assert message.block is None
    assert any(each is message.effort for each in arrays(message))
    assert_array_equal(message.numbers("effort"), (7.0, 8.0))


@pytest.mark.parametrize("copied", [copied, deepcopy])
def test_a_copy_has_numbers_of_its_own(message, copied):
    copy = copied(message)
    message.block[:] = -1.0
    assert_array_equal([copy.numbers(field) for field in FIELDS], np.arange(6.0).reshape(3, 2))
    assert copy.velocity is None and np.shares_memory(copy.effort, copy.block)


@pytest.mark.parametrize("fields", [("position",), ()])
def test_messages_whose_numbers_lie_apart_are_copied(fields):
    message = JointMessage(("a",), **{field: np.ones(1) for field in fields})
    copy = copied(message)
    for values in arrays(message):
        values[:] = 2.0
    assert copy == JointMessage(("a",), **{field: np.ones(1) for field in fields})


def test_points_are_copied():
    message = PointsMessage("world", ("a",), np.ones((1, 3)))
    copy = copied(message)
    message.values[:] = 2.0
    assert copy.names == ("a",) and (copy.values == 1.0).all()
