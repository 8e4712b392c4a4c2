"""The loop of a plugin on a machine that wakes it late or lets cycles take long: each one has a period of its own."""

from types import SimpleNamespace

import numpy as np
import pytest

from solfer.plugins import LoopState, run

RATE, CYCLES = 200.0, 200
PERIOD = 1.0 / RATE


class Machine:
    """A clock that wakes its sleeper late, and a plugin whose cycles cost time."""

    rate, life, name, transport = RATE, LoopState.RUNNING, "stub", 0.0

    def __init__(self, wakes_late, costs):
        self.time, self.starts = 0.0, []
        self._wakes_late, self._costs = iter(wakes_late), iter(costs)
        self.peers = SimpleNamespace(look=lambda: None)

    def now(self):
        return self.time

    def sleep_until(self, deadline):
        self.time = max(self.time, deadline + next(self._wakes_late, 0.0))

    def running(self):
        return len(self.starts) < CYCLES

    def cycle(self):
        self.starts.append(self.time)
        self.time += next(self._costs, 0.0)

    def report(self, *_):
        pass

    def health(self):
        return "OK", ""

    def figures(self):
        return {}

    def stop(self):
        pass

    close = stop


@pytest.mark.parametrize("seed", range(5))
def test_each_cycle_has_a_period_of_its_own(seed):
    random = np.random.default_rng(seed)
    machine = Machine(random.exponential(0.7 * PERIOD, 2 * CYCLES), random.exponential(0.3 * PERIOD, 2 * CYCLES))
    statistics = run(machine, machine)
    periods = np.floor((np.array(machine.starts) - machine.starts[0]) / PERIOD + 1e-9)
    assert (np.diff(periods) >= 1.0).all()
    assert statistics.skipped == periods[-1] + 1 - CYCLES > 0


def test_a_late_wake_up_is_not_made_up_for():
    machine = Machine([0.0, 0.0, 1.98 * PERIOD], [])
    run(machine, machine)
    assert np.diff(machine.starts[:5]) == pytest.approx(PERIOD * np.array([1.0, 2.98, 0.02, 1.0]))
