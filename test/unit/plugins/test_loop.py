"""The loop of a plugin on a machine that wakes it late or runs it slowly: each cycle has a period of its own."""

from types import SimpleNamespace

import numpy as np
import pytest

from solfer.plugins import LoopStatistics, PluginState, run
from solfer.plugins.timing.cycle_timing import CycleTiming, Stage

RATE, CYCLES = 200.0, 200
PERIOD = 1.0 / RATE


class Machine:
    """A clock that wakes its sleeper late."""

    name = "machine"

    def __init__(self, wakes_late, costs):
        self.time, self.plugin = 0.0, Costly(self, costs)
        self._wakes_late = iter(wakes_late)

    @property
    def starts(self):
        return self.plugin.starts

    def now(self):
        return self.time

    def sleep_until(self, deadline):
        self.time = max(self.time, deadline + next(self._wakes_late, 0.0))

    def running(self):
        return len(self.starts) < CYCLES

    def report(self, *_):
        pass


class Costly:
    """A plugin whose cycles cost time on a machine."""

    rate, life, name = RATE, PluginState.RUNNING, "stub"
    running, blending, claims = True, False, frozenset()
    overload = SimpleNamespace(reason="")

    def __init__(self, machine, costs):
        self.starts, self._machine, self._costs = [], machine, iter(costs)
        self.peers, self.outputs = SimpleNamespace(look=lambda: None), self
        self.tuning = SimpleNamespace(log=lambda: None)

    def measure_with(self, *clock):
        self.timing = CycleTiming(*clock)

    def pipe_reports(self):
        return iter(())

    def blend_in(self, shortest):
        pass

    def cycle(self):
        self.starts.append(self._machine.time)
        self._machine.time += next(self._costs, 0.0)

    def health(self):
        return "OK", ""

    def figures(self):
        return {}

    def stop(self):
        pass

    close = stop


@pytest.mark.daily(1)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_each_cycle_has_a_period_of_its_own(seed):
    random = np.random.default_rng(seed)
    machine = Machine(random.exponential(0.7 * PERIOD, 2 * CYCLES), random.exponential(0.3 * PERIOD, 2 * CYCLES))
    statistics = run(machine.plugin, machine)
    periods = np.floor((np.array(machine.starts) - machine.starts[0]) / PERIOD + 1e-9)
    assert (np.diff(periods) >= 1.0).all()
    assert statistics.skipped == periods[-1] + 1 - CYCLES > 0


@pytest.mark.slow
def test_a_late_wake_up_is_not_made_up_for():
    machine = Machine([0.0, 0.0, 1.98 * PERIOD], [])
    run(machine.plugin, machine)
    assert np.diff(machine.starts[:5]) == pytest.approx(PERIOD * np.array([1.0, 2.98, 0.02, 1.0]))


class Notes:
    """A recorder that keeps what it is given."""

    def __init__(self):
        self.cycles, self.states = [], []

    def record(self, time, late, took):
        self.cycles.append((time, late, took))

    def note(self, index, managed, time):
        self.states.append(managed.state)


@pytest.mark.slow
def test_each_cycle_is_recorded_once():
    machine, notes = Machine([0.0, 0.5 * PERIOD], [0.0, 0.25 * PERIOD]), Notes()
    run(machine.plugin, machine, recorder=notes)
    times, late, took = np.array(notes.cycles).T
    assert len(times) == CYCLES and (np.diff(times) > 0).all() and (took > 0).all()
    assert 1e-9 * times[1] == pytest.approx(machine.starts[1] + 0.25 * PERIOD)
    assert 1e-9 * late.max() == pytest.approx(0.5 * PERIOD)
    assert notes.states[0] is PluginState.STARTING and PluginState.RUNNING in notes.states


@pytest.mark.slow
def test_an_end_in_good_order_is_logged(caplog):
    machine = Machine([], [])
    caplog.set_level("INFO", "solfer")
    run(machine.plugin, machine)
    assert caplog.messages == [f"stub has ended in good order after {CYCLES} cycles"]


def test_statistics_are_those_of_the_last_cycles():
    """Quantiles by NumPy over a ring that has overflowed by one cycle; counts go on over the whole life."""
    statistics = LoopStatistics(5)
    assert statistics.summary() == {"cycles": 0}
    costs, transports, late = 1e-3 * np.array([[90, 1, 2, 3, 4, 12], [80, 9, 7, 5, 6, 8], [70, 0, 4, 1, 3, 2]])  # [s]
    for number in range(6):  # the first one is forgotten
        times = np.zeros(len(Stage), dtype=np.int64)
        times[[Stage.READ, Stage.COMPONENT]] = 0.25e9 * costs[number], 0.75e9 * costs[number]
        times[Stage.WRITE] = 1e9 * transports[number]
        statistics.add(times.data, late[number], number % 3)
    figures = statistics.summary()
    assert figures == pytest.approx(
        {
            "cycles": 6,
            "skipped periods": 6,
            "cycle median [ms]": 3.0,
            "cycle p99 [ms]": np.percentile([1, 2, 3, 4, 12], 99),
            "cycle max [ms]": 12.0,
            "transport median [ms]": 7.0,
            "late p99 [ms]": np.percentile([0, 1, 2, 3, 4], 99),
            "late max [ms]": 4.0,
        }
    )
