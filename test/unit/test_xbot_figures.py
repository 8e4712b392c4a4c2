"""What somebody sees who looks at an RT layer from outside, and what it means."""

import numpy as np
import pytest

from solfer.middleware.xbot.board import COUNTS, LOOP, Board
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.figures import Observer
from solfer.middleware.xbot.health import ERROR, GOOD, WARNING, layer_report, plugin_report
from solfer.middleware.xbot.lifecycle import Stage
from solfer.middleware.xbot.tally import tally

STAGES = ("read", "component", "write")


@pytest.fixture
def board(tmp_path):
    board = Board.create(tmp_path, 500.0, ["arm", "base"], STAGES)
    board.put_text("FIFO 60; without memory locked (Operation not permitted)")
    yield board
    board.close()


@pytest.fixture
def observer(board, tmp_path):
    return Observer(tmp_path)


def cycle(board, count=1, **times):
    """Cycles, with times of the rows of the loop, or of the stages of the first plugin [us]."""
    for _ in range(count):
        board.counts[COUNTS.index("cycles")] += 1
        taken = np.zeros(len(board.histograms.rows), dtype=np.int64)
        for name, time in times.items():
            taken[LOOP.index(name) if name in LOOP else board.row(0, STAGES.index(name))] = 1000 * time
        tally(board.histograms.rows, taken, 0)


def test_without_a_layer_there_is_nothing_to_see(tmp_path):
    assert Observer(tmp_path).look() is None
    board = Board.create(tmp_path, 500.0, ["arm"], STAGES)
    observer = Observer(tmp_path)
    assert observer.look() is not None
    board.close()
    assert observer.look() is None


def test_times_are_those_since_the_look_before_and_the_longest_is_that_of_the_whole_run(board, observer):
    cycle(board, 100, cycle=900, component=800)
    first = observer.look()
    cycle(board, 50, cycle=200, component=100)
    second = observer.look()
    for figures, median, count in ((first, 900e-6, 100), (second, 200e-6, 150)):
        whole = figures.loop[LOOP.index("cycle")]
        assert (whole.name, whole.count) == ("cycle", count)
        assert whole.median == pytest.approx(median, rel=1 / 16) and whole.p99 == pytest.approx(median, rel=1 / 16)
        assert whole.longest == pytest.approx(900e-6)
    component = second.plugins[0].stages[STAGES.index("component")]
    assert component.median == pytest.approx(100e-6, rel=1 / 16) and component.longest == pytest.approx(800e-6)
    assert second.plugins[1].stages[0].count == 0


def test_lives_counts_and_texts_are_seen(board, observer, tmp_path):
    board.put_life(1, Stage.ABORTED, 3, 2, 7)
    board.put_text("RuntimeError: no", 1)
    board.counts[COUNTS.index("skipped")], board.counts[COUNTS.index("overruns")] = 4, 2
    board.skips[board.row(1, 2)] = 4
    EmergencyStop(tmp_path).trip("a hand")
    seen = observer.look()
    assert (seen.rate, seen.skipped, seen.overruns, seen.alive) == (500.0, 4, 2, True)
    assert "FIFO 60; without memory locked" in seen.scheduling and "a hand" in seen.emergency_stop
    base = seen.plugins[1]
    assert (base.name, base.stage, base.reason) == ("base", "ABORTED", "RuntimeError: no")
    assert (base.starts, base.aborts, base.over_budget, base.stages[2].skipped) == (3, 2, 7, 4)


def test_a_layer_that_starts_anew_begins_at_zero(board, observer, tmp_path, monkeypatch):
    cycle(board, 10, cycle=100)
    observer.look()
    board.close()
    other = Board.create(tmp_path, 500.0, ["arm", "base"], STAGES)
    monkeypatch.setattr(Board, "pid", property(lambda _: 1))  # another process
    cycle(other, 1, cycle=700)
    assert observer.look().loop[0].median == pytest.approx(700e-6, rel=1 / 16)
    other.close()


def test_a_layer_is_healthy_while_it_cycles_in_time(board, observer):
    cycle(board, 3, cycle=100, lateness=20)
    before = observer.look()
    cycle(board)
    report = layer_report(observer.look(), before)
    assert (report.level, report.summary) == (GOOD, "runs at 500 Hz")
    assert report.values["cycles"] == 4 and report.values["emergency stop"] == "no"
    assert "without memory locked" in report.values["scheduling"]
    assert report.values["lateness max [us]"] == pytest.approx(20.0)


def test_what_is_too_late_is_a_warning_once(board, observer):
    before = observer.look()
    cycle(board)
    board.counts[COUNTS.index("skipped")], board.counts[COUNTS.index("overruns")] = 3, 1
    late = observer.look()
    report = layer_report(late, before)
    assert (report.level, report.summary) == (WARNING, "3 periods left out, 1 cycles too long")
    cycle(board)
    assert layer_report(observer.look(), late).level == GOOD


def test_a_layer_that_does_not_cycle_ended_or_was_stopped_is_an_error(board, observer, tmp_path, monkeypatch):
    cycle(board)
    before = observer.look()
    assert layer_report(before, None).level == GOOD  # a first look cannot tell
    report = layer_report(observer.look(), before)
    assert report.level == ERROR and "does not cycle" in report.summary
    EmergencyStop(tmp_path).trip("a hand")
    cycle(board)
    report = layer_report(observer.look(), before)
    assert report.level == ERROR and report.summary.startswith("emergency stop: a hand")
    monkeypatch.setattr(Board, "alive", False)
    report = layer_report(observer.look(), before)
    assert report.level == ERROR and "has ended without a word" in report.summary


@pytest.mark.parametrize(("stage", "reason", "level"), [
    (Stage.RUNNING, "", GOOD), (Stage.INITIALIZED, "", GOOD), (Stage.STARTING, "waits for the robot", WARNING),
    (Stage.ABORTED, "RuntimeError: no", ERROR), (Stage.FAULT, "it cannot hold", ERROR)])
def test_health_of_a_plugin_follows_its_stage(board, observer, stage, reason, level):
    board.put_life(0, stage, 1, 0, 0)
    board.put_text(reason, 0)
    cycle(board, component=100)
    report = plugin_report(observer.look().plugins[0])
    assert report.level == level and report.summary == (f"{stage.name}: {reason}" if reason else stage.name)
    assert report.values["component p99 [us]"] == pytest.approx(100.0, rel=1 / 16)
    assert np.isfinite([value for value in report.values.values() if not isinstance(value, str)]).all()
