"""Calls that take many cycles: their answers come when they are done."""

from concurrent.futures import Future

import pytest

from solfer.errors import ComponentError
from solfer.transport import Inbox


@pytest.mark.parametrize("fails", [False, True])
def test_an_answer_may_come_later(fails):
    inbox, later = Inbox(), Future()
    answer = inbox.submit(lambda: later)
    inbox.apply()
    inbox.apply()
    assert not answer.done()
    if fails:
        later.set_exception(ComponentError("no ground"))
        with pytest.raises(ComponentError, match="no ground"):
            answer.result(0.0)
    else:
        later.set_result("lifted")
        assert answer.result(0.0) == "lifted"


def test_of_some_calls_one_is_run_in_a_cycle():
    """Behind all others; none of them waits any longer where nothing is accepted."""
    inbox, ran = Inbox(), []
    futures = [inbox.submit_one_by_one(lambda number=number: ran.append(number)) for number in range(3)]
    inbox.submit(lambda: ran.append("other"))
    inbox.apply()
    assert ran == ["other", 0]
    inbox.apply()
    assert ran == ["other", 0, 1] and not futures[2].done()
    inbox.refusal = "it has stopped"
    inbox.apply()
    assert str(futures[2].exception(0)) == "it has stopped"


def test_calls_behind_one_that_ends_the_process_wait_for_the_next_cycle():
    inbox, ran = Inbox(), []
    inbox.submit(lambda: exit(4))
    inbox.submit(lambda: ran.append("behind"))
    assert inbox.waits
    with pytest.raises(SystemExit):
        inbox.apply()
    assert inbox.waits and not ran
    inbox.apply()
    assert ran == ["behind"] and not inbox.waits
