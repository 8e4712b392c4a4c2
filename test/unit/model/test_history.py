"""The history of a feedback: rows in their order, in memory of a fixed size."""

import numpy as np
from numpy.testing import assert_array_equal

from solfer.model import History, State


def test_more_messages_than_fit_drop_the_oldest():
    history = History(("position", "velocity"), np.array((6, 7)), 3)
    values = history.values
    for index in range(5):
        history.add(index, 10.0 + index, np.full((2, 2), index))
    assert (history.count, history.dropped, history.size) == (3, 2, 3)
    assert_array_equal(history.stamps, (2, 3, 4))
    assert_array_equal(history.arrivals, (12, 13, 14))
    assert_array_equal(history.values[:, 1, 0], (2, 3, 4))
    assert history.values is values
    history.clear()
    assert (history.count, history.dropped) == (0, 2)


def test_what_a_message_lacks_is_not_a_number():
    history = History(("position",), np.arange(3), 2)
    for part in (None, np.array((2,))):
        history.add(0.0, 0.0, np.ones((1, 3)), part)
    assert_array_equal(history.values[:, 0], ((1, 1, 1), (np.nan, np.nan, 1)))


def test_windows_of_a_state_have_the_same_histories():
    state = State(("hip", "knee"))
    window = state.window()
    state.histories.append(History(("position",), np.arange(2), 2))
    assert window.histories is state.histories and State(("hip",)).histories == []
