"""A loop that is too slow for its robot: found within a second, and motions slow down for it."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.watch import PERIOD as CYCLE
from support.unit.watch import Stage

from solfer.config.records.modules import OverloadRecord
from solfer.plugins.life.managed_plugin import ManagedPlugin
from solfer.plugins.timing.overload import Overload
from solfer.transport.health import Health
from solfer.transport.plugin_state import PluginState

PERIOD = 0.005


class PacedLoop:
    """Cycles that come when a test says, and the paces that follow."""

    def __init__(self, **limits):
        self.feedback = SimpleNamespace(measures=True, accepted=0)
        self.overload = Overload("walker", [self.feedback], PERIOD, OverloadRecord(**limits))

    def run(self, duration, gaps=(PERIOD,), receives=True):
        """Run for a time [s] with certain times between cycles, in turn; return all paces, and when each was."""
        time, paces = 0.0, []
        while time < duration:
            for gap in gaps:
                self.feedback.accepted += receives
                paces.append(self.overload.advance(gap))
                time += gap
        return paces


def test_a_loop_in_time_goes_on_in_full():
    loop = PacedLoop()
    assert set(loop.run(5.0)) == {1.0} and not loop.overload.reason
    assert set(loop.run(5.0, (PERIOD,) * 19 + (2 * PERIOD,))) == {1.0}  # a twentieth is left out


def test_measurements_in_bunches_overload_nothing():
    """A slow simulation lets the robot's time pass in steps of several periods, with none in between."""
    loop = PacedLoop()
    assert set(loop.run(5.0, (4 * PERIOD, 0.01 * PERIOD, 0.01 * PERIOD, 0.01 * PERIOD))) == {1.0}
    assert not loop.overload.reason and loop.overload.figures[0] < 0.02


def test_what_components_bridge_does_not_slow_them_down():
    loop = PacedLoop()
    assert set(loop.run(5.0, (PERIOD / 0.6,))) == {1.0} and "leaves out" in loop.overload.reason


@pytest.mark.parametrize(("gap", "rests"), [(2.4, False), (3.0, True), (15.0, True), (40.0, True)])
def test_periods_left_out_slow_down_and_stop(gap, rests):
    loop = PacedLoop()
    loop.run(2.0)
    paces = loop.run(5.0, (gap * PERIOD,))
    assert f"walker is {loop.overload.reason}".startswith("walker is overloaded: it leaves out")
    assert (paces[-1] == 0.0) is rests and paces[-1] < 0.6 and (np.diff(paces) <= 0.0).all()
    assert loop.overload.figures == pytest.approx((1.0 - 1.0 / gap, 0.0, paces[-1]), abs=0.05)


def test_what_rests_does_not_creep_on():
    """A loop about the limit, a little better and a little worse in turn, stays at rest until half of it is kept."""
    loop = PacedLoop()
    loop.run(5.0, (3.2 * PERIOD,))
    assert set(loop.run(5.0, (*(2.3 * PERIOD,) * 40, *(3.2 * PERIOD,) * 40))) == {0.0}
    assert loop.run(5.0, (1.8 * PERIOD,))[-1] == 1.0


@pytest.mark.parametrize("gap", [3.0, 15.0])
def test_it_goes_on_within_two_seconds(gap):
    loop = PacedLoop()
    loop.run(3.0, (gap * PERIOD,))
    paces = loop.run(2.0)
    assert np.argmax(np.array(paces) > 0.0) * PERIOD < 1.0 and paces[-1] > 0.6
    assert loop.overload.reason
    assert loop.run(3.0)[-1] == 1.0 and not loop.overload.reason


def test_an_old_measurement_slows_down_and_stops():
    loop = PacedLoop()
    loop.run(1.0)
    assert set(loop.run(0.045, receives=False)) == {1.0}
    loop.run(0.3, receives=False)
    assert loop.overload.reason.startswith("behind: its newest measurement is 5")
    assert loop.run(1.0, receives=False)[-1] == 0.0
    assert loop.run(2.0)[-1] == 1.0 and not loop.overload.reason


def test_limits_are_tags():
    loop = PacedLoop(left_out=0.4, age=0.5)
    assert set(loop.run(3.0, (1.5 * PERIOD,))) == {1.0} and not loop.overload.reason
    loop.run(3.0, (2.4 * PERIOD,))
    assert loop.overload.reason and loop.overload.pace < 1.0


def test_a_start_begins_in_full():
    loop = PacedLoop()
    loop.run(3.0, (0.1,))
    loop.overload.restart()
    assert loop.overload.figures.tolist() == [0.0, 0.0, 1.0] and not loop.overload.reason


def test_a_plugin_that_is_overloaded_says_so():
    """In its health, its figures, and as the reason of its state, which layers show and recordings keep."""
    stage = Stage()
    managed, changes = ManagedPlugin(stage.plugin), []
    managed.changed = lambda each: changes.append((each.state, each.reason))
    managed.start()

    def run(count, gap):
        for _ in range(count):
            stage.speak()
            managed.cycle()
            stage.bus.run_until(stage.bus.time + gap * CYCLE)

    run(20, 1)
    assert stage.plugin.health() == (Health.GOOD, "running") and changes[-1] == (PluginState.RUNNING, "")
    run(400, 3)
    level, sentence = stage.plugin.health()
    assert level is Health.WARNING and sentence.startswith("running; overloaded: it leaves out")
    assert stage.plugin.figures()["pace"] == stage.component.pace < 0.5
    assert changes[-1][0] is PluginState.RUNNING and changes[-1][1] in sentence
    run(1000, 1)
    assert changes[-1] == (PluginState.RUNNING, "") and stage.component.pace == 1.0
