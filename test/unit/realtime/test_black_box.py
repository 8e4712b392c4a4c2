"""Events in the recording of a real-time layer: how the lives of its plugins went on."""

from contextlib import closing
from types import SimpleNamespace

from support.plugins.several import Several

from solfer.plugins import PluginState
from solfer.realtime.telemetry.black_box import BlackBox
from solfer.realtime.telemetry.drain import RecordDrain

STARTING, RUNNING = PluginState.STARTING, PluginState.RUNNING


def test_only_a_plugin_that_ran_is_held(tmp_path):
    with closing(BlackBox(tmp_path, Several(names=("one", "two")).plugins)) as box:
        drain = RecordDrain(tmp_path)
        for state in (STARTING, STARTING, RUNNING, STARTING, RUNNING, PluginState.ABORTED, STARTING):
            box.note(1, SimpleNamespace(name="two", state=state, reason=""), 0)
        events = [(event.plugin, event.kind) for event in drain.events()]
    assert events == [("two", kind) for kind in ("start", "start", "run", "hold", "run", "abort", "start")]
