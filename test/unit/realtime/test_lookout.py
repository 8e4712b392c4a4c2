"""What is reported of plugins' peers beside the loop."""

import pytest

from solfer.realtime import lookout
from solfer.realtime.lookout import Lookout
from solfer.transport.health import Health

WAIT = 30.0  # [s]


class Peers:
    """Peers that complain as a test says, look by look, and are found after that."""

    def __init__(self, *complaints):
        self._complaints, self.looks = list(complaints), 0

    @property
    def done(self):
        return self.looks == len(self._complaints)

    def look(self):
        self.looks = min(self.looks + 1, len(self._complaints))

    def complaint(self):
        return self._complaints[self.looks - 1]


class Reports:
    """Keeps health reports."""

    def __init__(self):
        self.all = []

    def report(self, *report):
        self.all.append(report)


@pytest.fixture(autouse=True)
def _look_often(monkeypatch):
    monkeypatch.setattr(lookout, "PERIOD", 0.001)


def test_each_new_complaint_is_reported_once():
    reports = Reports()
    peers = {"one": Peers("no topic", "no topic", "no node", ""), "two": Peers("", ""), "three": Peers("late")}
    seen = Lookout(peers, reports)
    seen._thread.join(WAIT)
    assert not seen._thread.is_alive()  # nothing is left to look for
    seen.close()
    assert [report for report in reports.all if report[0] == "one pipes"] == [
        ("one pipes", Health.WARNING, "no topic", {}),
        ("one pipes", Health.WARNING, "no node", {}),
        ("one pipes", Health.GOOD, "running", {}),
    ]
    assert [report for report in reports.all if report[0] != "one pipes"] == [
        ("three pipes", Health.WARNING, "late", {})
    ]


def test_close_ends_a_lookout_that_still_looks(monkeypatch):
    monkeypatch.setattr(lookout, "PERIOD", WAIT)
    peers = Peers("missing", "missing")
    seen = Lookout({"one": peers}, Reports())
    seen.close()
    assert peers.looks == 0 and not seen._thread.is_alive()
