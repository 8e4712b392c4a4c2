"""The loop at a fixed rate, on a clock that only passes when it is slept on."""

import pytest

from solfer.transport.fixed_rate import FixedRateLoop

RATE = 100.0
PERIOD = 1.0 / RATE


class OversleepingClock:
    """Sleeps until a deadline, and so much longer as a test says."""

    def __init__(self, time=0.0):
        self.time = time
        self.oversleeps = {}

    def now(self):
        return self.time

    def sleep_until(self, deadline):
        self.time = max(self.time, deadline + self.oversleeps.pop(round(deadline, 6), 0.0))


def run(clock, cycles, costs=(), catch_up=0.0):
    """Run a loop; returns it, and when each cycle began, how late that was and how many periods it left out."""
    loop = FixedRateLoop(clock, RATE, catch_up)
    begins = []
    costs = dict(costs)

    def cycle(late, skipped):
        begins.append((clock.time, late, skipped))
        clock.time += costs.get(len(begins) - 1, 0.0)

    loop.run(cycle, lambda: len(begins) < cycles)
    return loop, begins


def test_deadlines_are_absolute():
    loop, begins = run(OversleepingClock(3.0), 1000, {index: 0.3 * PERIOD for index in range(0, 1000, 3)})
    assert [begin for begin, _, _ in begins] == pytest.approx([3.0 + PERIOD * index for index in range(1000)], abs=1e-9)
    assert loop.skipped == 0


def test_a_long_cycle_leaves_out_whole_periods():
    loop, begins = run(OversleepingClock(), 5, {1: 2.5 * PERIOD})
    assert [round(begin / PERIOD, 6) for begin, _, _ in begins] == [0, 1, 3.5, 4, 5]
    assert [skipped for _, _, skipped in begins] == [0, 0, 1, 0, 0] and loop.skipped == 1
    assert begins[2][1] == pytest.approx(1.5 * PERIOD)


def test_a_late_wake_up_leaves_out_whole_periods():
    clock = OversleepingClock()
    clock.oversleeps[round(2 * PERIOD, 6)] = 3.2 * PERIOD
    _, begins = run(clock, 4)
    assert [round(begin / PERIOD, 6) for begin, _, _ in begins] == [0, 1, 5.2, 6]
    assert [skipped for _, _, skipped in begins] == [0, 0, 3, 0]


@pytest.mark.parametrize(
    ("lag", "cycles", "skipped"), [(4.5, [0, 1, 5.5, 5.5, 5.5, 5.5, 6, 7], 0), (9.5, [0, 1, *[10.5] * 5, 11], 4)]
)
def test_a_lag_is_made_up_where_that_is_requested(lag, cycles, skipped):
    """Only what exceeds the largest lag is left out."""
    loop, begins = run(OversleepingClock(), 8, {1: lag * PERIOD}, catch_up=5 * PERIOD)
    assert [round(begin / PERIOD, 6) for begin, _, _ in begins] == cycles
    assert loop.skipped == skipped


def test_a_restart_is_due_at_once():
    clock = OversleepingClock()
    loop, _ = run(clock, 2)
    clock.time = 7.77
    loop.restart()
    assert loop.begin() == (0.0, 0)
    loop.wait()
    assert clock.time == pytest.approx(7.77 + PERIOD)
