"""Summaries of an RT layer read from outside, and health reports made from them."""

import numpy as np
import pytest

from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch, stopped
from solfer.telemetry.kernel import count_durations
from solfer.telemetry.statistics import LOOP_HISTOGRAMS, LoopCount, RuntimeStatistics
from solfer.telemetry.summaries import StatisticsReader, layer_report, plugin_report
from solfer.transport.health import Health

STAGES = ("read", "component", "write")


@pytest.fixture
def statistics(tmp_path):
    statistics = RuntimeStatistics.create(tmp_path, 500.0, ["arm", "base"], STAGES)
    statistics.put_text("FIFO 60; without memory locked (Operation not permitted)")
    yield statistics
    statistics.close()


@pytest.fixture
def observer(statistics, tmp_path):
    return StatisticsReader(tmp_path, stopped)


def cycle(statistics, count=1, **times):
    """Count cycles, with times of the rows of the loop, or of the stages of the first plugin [us]."""
    for _ in range(count):
        statistics.counts[LoopCount.CYCLES] += 1
        taken = np.zeros(len(statistics.histograms), dtype=np.int64)
        for name, time in times.items():
            taken[LOOP_HISTOGRAMS.index(name) if name in LOOP_HISTOGRAMS else statistics.row(0, STAGES.index(name))] = (
                1000 * time
            )
        count_durations(statistics.histograms, taken, 0)


def test_without_a_layer_there_is_nothing_to_see(tmp_path):
    assert StatisticsReader(tmp_path, stopped).look() is None
    statistics = RuntimeStatistics.create(tmp_path, 500.0, ["arm"], STAGES)
    observer = StatisticsReader(tmp_path, stopped)
    assert observer.look() is not None
    statistics.close()
    assert observer.look() is None


def test_only_the_longest_time_covers_the_run(statistics, observer):
    cycle(statistics, 100, cycle=900, component=800)
    first = observer.look()
    cycle(statistics, 50, cycle=200, component=100)
    second = observer.look()
    for figures, median, count in ((first, 900e-6, 100), (second, 200e-6, 150)):
        whole = figures.loop[LOOP_HISTOGRAMS.index("cycle")]
        assert (whole.name, whole.count) == ("cycle", count)
        assert whole.median == pytest.approx(median, rel=1 / 16) and whole.p99 == pytest.approx(median, rel=1 / 16)
        assert whole.longest == pytest.approx(900e-6)
    component = second.plugins[0].stages[STAGES.index("component")]
    assert component.median == pytest.approx(100e-6, rel=1 / 16) and component.longest == pytest.approx(800e-6)
    assert second.plugins[1].stages[0].count == 0


def test_lives_counts_and_texts_are_seen(statistics, observer, tmp_path):
    statistics.put_life(1, PluginState.ABORTED, 3, 2, 7)
    statistics.put_text("RuntimeError: no", 1)
    statistics.put_computed(1, {"kinematics": 40, "bias": 3, "something else": 9})
    statistics.counts[LoopCount.SKIPPED], statistics.counts[LoopCount.OVERRUNS] = 4, 2
    statistics.skips[statistics.row(1, 2)] = 4
    EmergencyStopLatch(tmp_path).trip("a hand")
    seen = observer.look()
    assert (seen.rate, seen.skipped, seen.overruns, seen.alive) == (500.0, 4, 2, True)
    assert "FIFO 60; without memory locked" in seen.scheduling and "a hand" in seen.emergency_stop
    base = seen.plugins[1]
    assert (base.name, base.stage, base.reason) == ("base", "ABORTED", "RuntimeError: no")
    assert {name: count for name, count in base.computed.items() if count} == {"kinematics": 40, "bias": 3}
    assert plugin_report(base).values["computed bias"] == 3 and not any(seen.plugins[0].computed.values())
    assert (base.starts, base.aborts, base.over_budget, base.stages[2].skipped) == (3, 2, 7, 4)


def test_a_layer_that_starts_anew_begins_at_zero(statistics, observer, tmp_path, monkeypatch):
    cycle(statistics, 10, cycle=100)
    observer.look()
    statistics.close()
    other = RuntimeStatistics.create(tmp_path, 500.0, ["arm", "base"], STAGES)
    monkeypatch.setattr(RuntimeStatistics, "pid", property(lambda _: 1))  # another process
    cycle(other, 1, cycle=700)
    assert observer.look().loop[0].median == pytest.approx(700e-6, rel=1 / 16)
    other.close()


def test_a_layer_in_time_is_healthy(statistics, observer):
    cycle(statistics, 3, cycle=100, lateness=20)
    before = observer.look()
    cycle(statistics)
    report = layer_report(observer.look(), before)
    assert (report.level, report.summary) == (Health.GOOD, "runs at 500 Hz")
    assert report.values["cycles"] == 4 and report.values["emergency stop"] == "no"
    assert "without memory locked" in report.values["scheduling"]
    assert report.values["lateness max [us]"] == pytest.approx(20.0)


def test_lateness_is_a_warning_once(statistics, observer):
    before = observer.look()
    cycle(statistics)
    statistics.counts[LoopCount.SKIPPED], statistics.counts[LoopCount.OVERRUNS] = 3, 1
    late = observer.look()
    report = layer_report(late, before)
    assert (report.level, report.summary) == (Health.WARNING, "periods left out: 3, cycles too long: 1")
    cycle(statistics)
    assert layer_report(observer.look(), late).level == Health.GOOD


def test_a_layer_without_cycles_is_an_error(statistics, observer, tmp_path, monkeypatch):
    cycle(statistics)
    before = observer.look()
    assert layer_report(before, None).level == Health.GOOD  # a first summary cannot show it
    report = layer_report(observer.look(), before)
    assert report.level == Health.ERROR and "does not cycle" in report.summary
    EmergencyStopLatch(tmp_path).trip("a hand")
    cycle(statistics)
    report = layer_report(observer.look(), before)
    assert report.level == Health.ERROR and report.summary.startswith("emergency stop: a hand")
    monkeypatch.setattr(RuntimeStatistics, "alive", False)
    report = layer_report(observer.look(), before)
    assert report.level == Health.ERROR and "has ended unexpectedly" in report.summary


@pytest.mark.parametrize(
    ("stage", "reason", "level"),
    [
        (PluginState.RUNNING, "", Health.GOOD),
        (PluginState.INITIALIZED, "", Health.GOOD),
        (PluginState.STARTING, "waits for the robot", Health.WARNING),
        (PluginState.ABORTED, "RuntimeError: no", Health.ERROR),
        (PluginState.FAULT, "it cannot hold", Health.ERROR),
    ],
)
def test_health_of_a_plugin_follows_its_stage(statistics, observer, stage, reason, level):
    statistics.put_life(0, stage, 1, 0, 0)
    statistics.put_text(reason, 0)
    cycle(statistics, component=100)
    report = plugin_report(observer.look().plugins[0])
    assert report.level == level and report.summary == (f"{stage.name}: {reason}" if reason else stage.name)
    assert report.values["component p99 [us]"] == pytest.approx(100.0, rel=1 / 16)
    assert np.isfinite([value for value in report.values.values() if not isinstance(value, str)]).all()
