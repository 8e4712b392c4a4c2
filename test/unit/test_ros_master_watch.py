"""The watch over the ROS master, with a master that a test plays."""

import threading

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.ros.master_watch import MasterWatch

WAIT = 30.0  # [s]


class Master:
    """Answers with numbers; None: it does not answer."""

    def __init__(self, *numbers):
        self._numbers, self.asked = list(numbers), 0
        self.all_asked = threading.Event()

    def __call__(self):
        self.asked += 1
        number = self._numbers.pop(0) if len(self._numbers) > 1 else self._numbers[0]
        if len(self._numbers) == 1 and self.asked > 5:
            self.all_asked.set()
        if number is None:
            raise MiddlewareError("the ROS master does not answer (refused)", where="http://localhost:11311")
        return number


def watched(master):
    """What the watch says when it has ended."""
    watch = MasterWatch(master, 0.001)
    watch._thread.join(WAIT)
    return watch.loss


def test_a_master_that_stays_is_no_loss():
    master = Master(1)
    watch = MasterWatch(master, 0.001)
    assert master.all_asked.wait(WAIT)
    watch.close()
    assert watch.loss == ""


def test_a_master_that_does_not_answer_is_lost():
    assert watched(Master(1, 1, None)) == "the ROS master does not answer (refused)"


def test_another_master_is_a_loss():
    assert watched(Master(1, 1, 2)).startswith("another ROS master answers at http")


def test_without_a_master_there_is_nothing_to_watch():
    with pytest.raises(MiddlewareError, match="does not answer"):
        MasterWatch(Master(None), 0.001)
