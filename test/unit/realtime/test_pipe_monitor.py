"""What is reported of plugins' pipes and their peers beside the loop."""

import pytest
from support.processes import until

from solfer.realtime.pipe_monitor import PipeMonitor
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

WAIT = 30.0  # [s]


class Peers:
    """Peers that are missing as a test says, look by look, and are found after that."""

    def __init__(self, *warnings):
        self._warnings, self.looks = list(warnings), 0

    @property
    def done(self):
        return self.looks == len(self._warnings)

    def look(self):
        self.looks = min(self.looks + 1, len(self._warnings))

    def warning(self):
        return self._warnings[self.looks - 1]


class AllReports:
    """Keeps health reports."""

    def __init__(self):
        self.all = []

    def report(self, *report):
        self.all.append(report)


@pytest.fixture(autouse=True)
def _look_often(monkeypatch):
    monkeypatch.setattr(PipeMonitor, "PERIOD", 0.001)


def test_each_new_warning_is_reported_once():
    reports = AllReports()
    peers = {"one": Peers("no topic", "no topic", "no node", ""), "two": Peers("", ""), "three": Peers("late")}
    seen = PipeMonitor(peers, reports, ())
    until(lambda: all(each.done for each in peers.values()))
    seen.close()
    assert [report for report in reports.all if report[0] == "one pipes"] == [
        ("one pipes", Health.WARNING, "no topic", {}),
        ("one pipes", Health.WARNING, "no node", {}),
        ("one pipes", Health.GOOD, "running", {}),
    ]
    assert [report for report in reports.all if report[0] != "one pipes"] == [
        ("three pipes", Health.WARNING, "late", {})
    ]


def test_close_ends_a_monitor_that_still_looks(monkeypatch):
    monkeypatch.setattr(PipeMonitor, "PERIOD", WAIT)
    peers = Peers("missing", "missing")
    seen = PipeMonitor({"one": peers}, AllReports(), ())
    seen.close()
    assert peers.looks == 0 and not seen._thread.is_alive()


def test_pipes_are_reported_again_and_again_also_when_all_peers_are_found():
    reports, figures = AllReports(), iter(range(1000))

    def pipes():
        yield "one feedback imu", HealthReport(Health.WARNING, "late", {"messages": next(figures)})
        yield "one controller left", HealthReport(Health.GOOD, "sent", {})

    seen = PipeMonitor({"one": Peers("")}, reports, [pipes])
    until(lambda: len(reports.all) >= 4)
    seen.close()
    assert reports.all[:3] == [
        ("one feedback imu", Health.WARNING, "late", {"messages": 0}),
        ("one controller left", Health.GOOD, "sent", {}),
        ("one feedback imu", Health.WARNING, "late", {"messages": 1}),
    ]
