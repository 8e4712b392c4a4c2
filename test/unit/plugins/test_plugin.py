"""The life of a plugin and the stages of its cycle."""

from itertools import count

from support.unit.watch import Stage

from solfer.plugins import PluginState
from solfer.plugins.cycle_timing import STAGES


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
