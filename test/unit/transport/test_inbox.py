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
