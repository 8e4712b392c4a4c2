"""The watch over the ROS master, with a master that a test plays."""

import threading

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.ros.node.master_watch import MasterWatch

WAIT = 30.0  # [s]


class AnsweringMaster:
    """Answers with numbers, then for ever with the last of them; None: it does not answer.

    Args:
        numbers: Its answers.
        known: Whether it knows the node, answer by answer; by default always.
    """

    def __init__(self, *numbers, known=(True,)):
        self._numbers, self._known, self.asked = list(numbers), list(known), 0
        self.all_asked, self.lost = threading.Event(), threading.Event()

    def number(self):
        self.asked += 1
        number = self._numbers.pop(0) if len(self._numbers) > 1 else self._numbers[0]
        if len(self._numbers) == 1 and len(self._known) == 1 and self.asked > 20:
            self.all_asked.set()
        if number is None:
            raise MiddlewareError("the ROS master does not answer (refused)", where="http://localhost:11311")
        return number

    def known(self):
        return self._known.pop(0) if len(self._known) > 1 else self._known[0]

    def watch(self, patience=0.0):
        return MasterWatch(self.lost.set, self.number, self.known, 0.001, patience)


def watched(master):
    """Return the loss when the watch has ended."""
    watch = master.watch()
    assert master.lost.wait(WAIT)
    return watch.loss


@pytest.mark.parametrize(
    ("numbers", "known"),
    [((1,), (True,)), ((1, None, None, 1), (True,)), ((1,), (False, False, True))],
    ids=["stays", "away", "later"],
)
def test_a_master_that_keeps_its_node_is_kept(numbers, known):
    master = AnsweringMaster(*numbers, known=known)
    watch = master.watch()
    assert master.all_asked.wait(WAIT)
    watch.close()
    assert watch.loss == "" and not master.lost.is_set()


def test_a_master_without_answers_is_lost_in_time():
    assert watched(AnsweringMaster(1, 1, None)) == "the ROS master does not answer (refused)"
    patient = AnsweringMaster(1, None)
    watch = patient.watch(patience=2.0 * WAIT)
    assert patient.all_asked.wait(WAIT)
    watch.close()
    assert watch.loss == ""


def test_another_master_is_a_loss():
    assert watched(AnsweringMaster(1, 1, 2)).startswith("another ROS master answers at http")


def test_a_master_that_forgets_its_node_is_lost():
    assert "does not know this node any more" in watched(AnsweringMaster(1, known=(True, False)))


def test_without_a_master_there_is_nothing_to_watch():
    with pytest.raises(MiddlewareError, match="does not answer"):
        AnsweringMaster(None).watch()
