"""Health of pipes and of the process, in the reports of a plugin's loop."""

import pytest
from support.plugins.fleet import RATE, Fleet, still, tree

from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins.life.plugin_set import PluginSet
from solfer.plugins.timing.loop import PluginLoop
from solfer.transport.health import Health


@pytest.fixture
def fleet(tmp_path):
    changed = tree()
    changed["feedback"]["joints"] |= {"timeout": 0.1, "strikes": 1}
    changed["modules"]["first"]["controller"] = ["left"]
    return Fleet(tmp_path, changed, ("first",), together=False)


class ReportedLoop:
    """The loop of a plugin, cycle by cycle, and what is reported."""

    def __init__(self, fleet):
        self._fleet, (middleware,) = fleet, fleet.middlewares
        self._loop = PluginLoop(PluginSet(fleet.plugins), middleware)
        self._loop.plugins.start()
        self._watcher = MemoryMiddleware(fleet.bus, "watcher")
        self._watcher.reports()

    def run(self, duration, moving=True, skipped=0):
        """Cycle for some time [s], with measured joints or without; return the reports by their parts."""
        for _ in range(round(duration * RATE)):
            if moving:
                self._fleet.publish(**still())
            self._fleet.bus.run_until(self._fleet.bus.time + 1.0 / RATE)
            self._loop._cycle(0.0, skipped)
        return dict(self._watcher.reports())


def test_pipes_and_process_are_reported_beside_the_plugin(fleet):
    reports = ReportedLoop(fleet).run(2.5)
    levels = {name: (report.level, report.summary) for name, report in reports.items()}
    assert levels == {
        "first": (Health.GOOD, "running"),
        "first process": (Health.GOOD, "in time"),
        "first feedback joints": (Health.GOOD, "received"),
        "first controller left": (Health.GOOD, "sent"),
    }
    assert reports["first process"].values["cycles"] >= 400
    assert reports["first feedback joints"].values["joints messages"] > 300


def test_what_is_missing_is_named(fleet):
    fleet.plugins[0].feedbacks[0].required = True
    loop = ReportedLoop(fleet)
    report = loop.run(1.5, moving=False)["first feedback joints"]
    assert report.level is Health.WARNING and report.summary == "nothing received on joint_states yet"
    loop.run(2.5)
    reports = loop.run(2.5, moving=False)
    report = reports["first feedback joints"]
    assert report.level is Health.ERROR
    assert report.summary == "nothing new on joint_states: the plugin holds until it is back"
    assert reports["first controller left"].summary == "not sent"
    assert loop.run(2.5)["first feedback joints"].level is Health.GOOD


def test_skipped_periods_are_a_warning_of_the_process(fleet):
    loop = ReportedLoop(fleet)
    report = loop.run(2.5, skipped=1)["first process"]
    assert report.level is Health.WARNING and report.summary.endswith("periods skipped")
    assert loop.run(2.5)["first process"].level is Health.GOOD
