"""Histograms, leaky counters, the statistics memory and the clocks of the RT layer."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.clock import MonotonicClock, SteppedClock
from solfer.plugins import PluginState
from solfer.telemetry.histograms import ROW_WORDS, bucket_of, quantile, since, upper_edge
from solfer.telemetry.kernel import count_durations
from solfer.telemetry.statistics import LOOP_HISTOGRAMS, LoopCount, PluginCount, RuntimeStatistics


def count(histograms, row, *times):
    """Count times in one row, as cycles in which all others are zero."""
    for time in times:
        count_durations(histograms, np.where(np.arange(len(histograms)) == row, time, 0), 0)


@given(st.integers(0, 3 * 10**9))
def test_buckets_are_at_most_a_sixteenth_wide(nanoseconds):
    bucket = bucket_of(nanoseconds)
    low, high = upper_edge(bucket - 1) if bucket else 0, upper_edge(bucket)
    assert low <= nanoseconds < high
    assert high - low <= max(64, low / 16)


@pytest.mark.parametrize("nanoseconds", [-5, 10**12])
def test_times_out_of_range_count_in_outer_buckets(nanoseconds):
    histograms = np.zeros((1, ROW_WORDS), dtype=np.int64)
    count(histograms, 0, nanoseconds)
    assert histograms[0, 0] == 1
    assert histograms[0, 1] == max(nanoseconds, 0)


def test_quantiles_are_those_of_numpy_within_a_bucket():
    times = np.random.default_rng(3).lognormal(11.0, 1.0, 20000).astype(int)
    histograms = np.zeros((2, ROW_WORDS), dtype=np.int64)
    count(histograms, 1, *times)
    assert histograms[0, 0] == quantile(histograms[0], 0.5) == 0
    assert histograms[1, 0] == 20000 and histograms[1, 1] == times.max()
    for share in (0.5, 0.9, 0.99, 0.999):
        exact = np.quantile(times, share, method="inverted_cdf")
        assert exact <= quantile(histograms[1], share) <= exact * 17 / 16 + 64
    assert quantile(histograms[1], 1.0) == times.max()


def test_a_zero_counts_for_the_loop_only():
    histograms = np.zeros((3, ROW_WORDS), dtype=np.int64)
    count_durations(histograms, np.array([0, 0, 70]), 1)
    assert [histograms[row, 0] for row in range(3)] == [1, 0, 1]


def test_statistics_are_shared_with_other_processes(tmp_path):
    """A second attachment sees counts, states, texts and histograms at once, and whether the layer is alive."""
    statistics = RuntimeStatistics.create(tmp_path, 500.0, ["one", "two"], ["read", "component"])
    statistics.counts[LoopCount.SKIPPED] = 7
    statistics.put_life(1, PluginState.ABORTED, 3, 2, 1)
    statistics.put_text("granted nothing")
    statistics.put_text("because", 1)
    count(statistics.histograms, statistics.row(1, 1), 12345)
    seen = RuntimeStatistics.attach(tmp_path)
    assert (seen.rate, seen.plugins, seen.stages) == (500.0, ("one", "two"), ("read", "component"))
    assert (
        seen.counts[LoopCount.SKIPPED] == 7
        and seen.state(1) is PluginState.ABORTED
        and seen.state(0) is PluginState.CONFIGURED
    )
    assert [seen.life(1)[word] for word in PluginCount] == [6, 3, 2, 1]
    assert seen.text() == "granted nothing" and seen.text(1) == "because" and seen.text(0) == ""
    assert seen.histograms[seen.row(1, 1), 1] == 12345 and seen.histograms[len(LOOP_HISTOGRAMS), 0] == 0
    assert seen.alive and seen.pid == statistics.pid
    statistics.close()
    assert not seen.alive
    with pytest.raises(MiddlewareError, match="no RT layer"):
        RuntimeStatistics.attach(tmp_path)


def test_a_second_executor_in_a_namespace_is_refused(tmp_path):
    statistics = RuntimeStatistics.create(tmp_path, 500.0, ["one"], ["read"])
    with pytest.raises(MiddlewareError, match="writes here already"):
        RuntimeStatistics.create(tmp_path, 1000.0, ["one"], ["read"])
    statistics.close()


def test_a_long_text_is_cut_off():
    statistics = RuntimeStatistics(500.0, ["one"], ["read"])
    statistics.put_text("x" * 1000, 0)
    assert statistics.text(0) == "x" * 256 and statistics.text() == ""


def test_a_stepped_clock_never_goes_back():
    published = []
    clock = SteppedClock(io.StringIO("0.5\n0.2\n2.0\n"), published.append)
    clock.sleep_until(1.0)
    assert clock.now() == 2.0 and clock.nanoseconds() == 2_000_000_000 and published == ["0.0", "0.5", "0.5"]
    clock.sleep_until(1.5)
    assert clock.now() == 2.0 and not clock.ended
    clock.sleep_until(3.0)  # no more lines
    assert clock.ended and clock.now() == 3.0


@pytest.mark.parametrize("line", ["soon", "nan"])
def test_a_line_without_a_time_is_refused(line):
    with pytest.raises(MiddlewareError, match=f"invalid time '{line}'"):
        SteppedClock(io.StringIO(f"{line}\n"), lambda _: None).sleep_until(1.0)


def test_the_monotonic_clock_never_wakes_early():
    clock = MonotonicClock()
    for duration in (0.0, 1e-4, 3e-3):
        deadline = clock.now() + duration
        clock.sleep_until(deadline)
        assert clock.now() >= deadline


def test_counts_since_a_snapshot():
    histograms = np.zeros((1, ROW_WORDS), dtype=np.int64)
    count(histograms, 0, 10**6)
    before = histograms.copy()
    count(histograms, 0, 1000, 1000, 1000)
    (recent,) = since(histograms, before)
    assert recent[0] == 3 and recent[1] == 10**6
    assert 1000 < quantile(recent, 0.99) <= 1000 + 64
