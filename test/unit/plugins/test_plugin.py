"""The life of a plugin and the stages of its cycle."""

import math
from itertools import count

import pytest
from support.unit.watch import PERIOD, Stage

from solfer.plugins import PluginState
from solfer.plugins.timing.cycle_timing import STAGES
from solfer.plugins.timing.robot_time import RobotTime


def test_each_stage_has_its_time():
    stage = Stage()
    stage.cycles(3, speaks=True)
    stage.plugin.measure_with(count().__next__)  # each look at the clock is one later
    stage.cycles(1, speaks=True)
    assert list(stage.plugin.timing.times) == [1] * len(STAGES)


def test_a_closed_plugin_stays_closed():
    stage, closed = Stage(), []
    stage.component.close = lambda: closed.append(True)
    stage.cycles(3, speaks=True)
    plugin = stage.plugin
    plugin.stop()
    assert plugin.life is PluginState.STOPPED
    plugin.close()
    for end in (plugin.stop, plugin.abort, plugin.close):
        end()
        assert plugin.life is PluginState.CLOSED
    assert closed == [True]


@pytest.mark.parametrize(
    ("starts", "passed"),
    [
        ((0.0, 1.0, 2.0, 3.0), (1, 1, 1)),
        ((0.4, 1.9, 2.0, 3.9), (1, 1, 1)),  # late, in a period of its own
        ((0.0, 2.0, 3.0, 7.0), (2, 1, 4)),
        ((0.0, 2.6, 3.0, 4.9, 5.0), (2, 1, 1, 1)),  # late after one that was left out
    ],
)
def test_periods_that_were_left_out_count(starts, passed):
    time = RobotTime((), 0.005)
    time.restart(10.0 + 0.005 * starts[0])
    assert tuple(round(time.advance(10.0 + 0.005 * start, math.nan, -1) / 0.005) for start in starts[1:]) == passed


def test_a_component_knows_how_long_it_paused():
    stage, passed = Stage(stall=1.0), []
    stage.component.update = lambda: passed.append(round(stage.component.passed / PERIOD, 9))
    stage.cycles(3, speaks=True)
    stage.bus.run_until(stage.bus.time + 3.0 * PERIOD)
    stage.cycles(2, speaks=True)
    assert passed == [1.0, 1.0, 1.0, 4.0, 1.0]
