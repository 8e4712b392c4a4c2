"""Pacing on a clock that the tests turn."""

import pytest

from solfer.simulation.server.pace import Pace


class SleepingClock:
    """A clock that moves when a process sleeps or works."""

    def __init__(self):
        self.time = 100.0

    def now(self):
        """Monotonic time [s]."""
        return self.time

    def sleep_until(self, deadline):
        """Sleep."""
        self.time = max(self.time, deadline)


@pytest.fixture
def clock():
    """Make a clock that does not start at zero."""
    return SleepingClock()


def run(pace, clock, steps, work, begin=0):
    """Make steps of one simulated millisecond that take `work` seconds each."""
    for step in range(begin, begin + steps):
        clock.time += work
        pace.wait(step * 1e-3)


def test_real_time(clock):
    pace = Pace(clock)
    run(pace, clock, 3001, 0.0003)
    assert clock.time == pytest.approx(100.0003 + 3.0)
    assert pace.measured == pytest.approx(1.0, abs=2e-3)
    assert pace.lost == 0.0


def test_half_speed_and_no_pause_at_all(clock):
    run(Pace(clock, factor=0.5), clock, 1001, 0.0003)
    assert clock.time == pytest.approx(100.0003 + 2.0)
    begin = clock.time
    free = Pace(clock, factor=0.0)
    run(free, clock, 5001, 0.0004)
    assert clock.time == pytest.approx(begin + 5001 * 0.0004)
    assert free.measured == pytest.approx(2.5, rel=1e-2)
    assert free.lost == 0.0


def test_only_a_short_stall_is_made_up(clock):
    pace = Pace(clock)
    run(pace, clock, 100, 0.0003)
    clock.time += 0.015
    run(pace, clock, 100, 0.0003, begin=100)
    assert pace.lost == 0.0
    assert clock.time == pytest.approx(100.0003 + 0.199)
    clock.time += 0.1
    run(pace, clock, 200, 0.0003, begin=200)
    assert pace.lost == pytest.approx(0.08, abs=1e-3)
    assert clock.time == pytest.approx(100.0003 + 0.399 + pace.lost)


def test_a_slow_simulation_reports_lost_time(clock):
    pace = Pace(clock)
    run(pace, clock, 2000, 0.002)
    assert pace.measured == pytest.approx(0.5, abs=0.01)
    assert pace.lost == pytest.approx(2.0 - 0.02, abs=0.01)


def test_a_time_that_goes_back_starts_anew(clock):
    pace = Pace(clock)
    run(pace, clock, 1000, 0.0003)
    begin = clock.time
    run(pace, clock, 501, 0.0003)
    assert clock.time == pytest.approx(begin + 0.0003 + 0.5)
    assert pace.lost == 0.0
