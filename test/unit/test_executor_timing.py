"""Histograms, forgiving counters, the board and the clocks of the RT layer."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.board import COUNTS, LOOP, Board
from solfer.middleware.xbot.clock import MonotonicClock, SteppedClock
from solfer.middleware.xbot.lifecycle import Stage
from solfer.middleware.xbot.tally import tally
from solfer.middleware.xbot.timing import WIDTH, Histograms, LeakyCounter, bucket_of, upper_edge


def count(histograms, row, *times):
    """Count times in one row, as cycles in which nothing else took any."""
    for time in times:
        tally(histograms.rows, np.where(np.arange(len(histograms.rows)) == row, time, 0), 0)


@given(st.integers(0, 3 * 10**9))
def test_a_time_lies_in_its_bucket_which_is_at_most_a_sixteenth_wide(nanoseconds):
    bucket = bucket_of(nanoseconds)
    low, high = upper_edge(bucket - 1) if bucket else 0, upper_edge(bucket)
    assert low <= nanoseconds < high
    assert high - low <= max(64, low / 16)


@pytest.mark.parametrize("nanoseconds", [-5, 10**12])
def test_what_is_out_of_range_is_counted_in_the_outer_buckets(nanoseconds):
    histograms = Histograms(np.zeros(WIDTH, dtype=np.int64))
    count(histograms, 0, nanoseconds)
    assert histograms.count(0) == 1
    assert histograms.longest(0) == max(nanoseconds, 0)


def test_quantiles_are_those_of_numpy_within_a_bucket():
    times = np.random.default_rng(3).lognormal(11.0, 1.0, 20000).astype(int)
    histograms = Histograms(np.zeros(2 * WIDTH, dtype=np.int64))
    count(histograms, 1, *times)
    assert histograms.count(0) == histograms.quantile(0, 0.5) == 0
    assert histograms.count(1) == 20000 and histograms.longest(1) == times.max()
    for share in (0.5, 0.9, 0.99, 0.999):
        exact = np.quantile(times, share, method="inverted_cdf")
        assert exact <= histograms.quantile(1, share) <= exact * 17 / 16 + 64
    assert histograms.quantile(1, 1.0) == times.max()


def test_a_stage_that_a_plugin_did_not_come_to_does_not_count_but_a_punctual_cycle_does():
    histograms = Histograms(np.zeros(3 * WIDTH, dtype=np.int64))
    tally(histograms.rows, np.array([0, 0, 70]), 1)
    assert [histograms.count(row) for row in range(3)] == [1, 0, 1]


def test_a_good_turn_forgives_a_bad_one():
    counter = LeakyCounter(3)
    assert [counter.add(bad) for bad in (True, False, False, True, True, False, True, True)] == [False] * 7 + [True]
    assert counter.total == 5
    counter.reset()
    assert counter.count == 0 and counter.total == 5


def test_others_see_what_the_executor_writes_on_its_board(tmp_path):
    board = Board.create(tmp_path, 500.0, ["one", "two"], ["read", "component"])
    board.counts[COUNTS.index("skipped")] = 7
    board.put_life(1, Stage.ABORTED, 3, 2, 1)
    board.put_text("granted nothing")
    board.put_text("because", 1)
    count(board.histograms, board.row(1, 1), 12345)
    seen = Board.attach(tmp_path)
    assert (seen.rate, seen.plugins, seen.stages) == (500.0, ("one", "two"), ("read", "component"))
    assert seen.counts[1] == 7 and seen.stage(1) is Stage.ABORTED and seen.stage(0) is Stage.CONFIGURED
    assert seen.life(1) == {"stage": 6, "starts": 3, "aborts": 2, "over budget": 1}
    assert seen.text() == "granted nothing" and seen.text(1) == "because" and seen.text(0) == ""
    assert seen.histograms.longest(seen.row(1, 1)) == 12345 and seen.histograms.count(len(LOOP)) == 0
    assert seen.alive and seen.pid == board.pid
    board.close()
    assert not seen.alive
    with pytest.raises(MiddlewareError, match="no RT layer"):
        Board.attach(tmp_path)


def test_a_second_executor_in_a_namespace_is_refused(tmp_path):
    board = Board.create(tmp_path, 500.0, ["one"], ["read"])
    with pytest.raises(MiddlewareError, match="writes here already"):
        Board.create(tmp_path, 1000.0, ["one"], ["read"])
    board.close()


def test_a_text_that_is_too_long_is_cut_off():
    board = Board(500.0, ["one"], ["read"])
    board.put_text("x" * 1000, 0)
    assert board.text(0) == "x" * 256 and board.text() == ""


def test_a_stepped_clock_goes_by_the_lines_and_never_back():
    told = []
    clock = SteppedClock(io.StringIO("0.5\n0.2\n2.0\n"), told.append)
    clock.sleep_until(1.0)
    assert clock.now() == 2.0 and clock.nanoseconds() == 2_000_000_000 and told == ["0.0", "0.5", "0.5"]
    clock.sleep_until(1.5)
    assert clock.now() == 2.0 and not clock.ended
    clock.sleep_until(3.0)  # no more lines
    assert clock.ended and clock.now() == 3.0


def test_a_line_that_is_no_time_is_refused():
    with pytest.raises(MiddlewareError, match="'soon' is no time"):
        SteppedClock(io.StringIO("soon\n"), lambda _: None).sleep_until(1.0)


def test_the_monotonic_clock_never_wakes_early():
    clock = MonotonicClock()
    for duration in (0.0, 1e-4, 3e-3):
        deadline = clock.now() + duration
        clock.sleep_until(deadline)
        assert clock.now() >= deadline


def test_what_was_counted_since_a_snapshot():
    histograms = Histograms(np.zeros(WIDTH, dtype=np.int64))
    count(histograms, 0, 10**6)
    before = histograms.snapshot()
    count(histograms, 0, 1000, 1000, 1000)
    since = histograms.since(before)
    assert since.count(0) == 3 and since.longest(0) == 10**6
    assert 1000 < since.quantile(0, 0.99) <= 1000 + 64
