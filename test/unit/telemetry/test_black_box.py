"""Events in the recording of a real-time layer: how the lives of its plugins went on."""

from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest
from support.plugins.several import Several

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import PluginState
from solfer.recording.reader import read
from solfer.recording.writer import RecordingWriter
from solfer.telemetry.black_box import TRUTH_MESSAGE, BlackBox
from solfer.telemetry.drain import RecordDrain
from solfer.transport import BodyMessage

STARTING, RUNNING = PluginState.STARTING, PluginState.RUNNING


def test_ros_time_is_a_column(tmp_path):
    """A clock that goes twice as fast as the loop's."""
    times = iter((1000.25, 1000.75))
    with closing(BlackBox(tmp_path, Several(names=("one",)).plugins, ros_time=lambda: next(times))) as box:
        drain = RecordDrain(tmp_path).only(["one"])
        for time in (1.0, 1.25):
            box.record(round(1e9 * time), 0, 0)
        with closing(RecordingWriter(tmp_path / "run.mcap", {})) as writer:
            drain.into(writer).fill()
            writer.finish(drain.lost)
    channel = read(tmp_path / "run.mcap")["one/ros_time"]
    assert channel.units == ("s",) and channel.values[:, 0] == pytest.approx([1000.25, 1000.75], abs=1e-6)
    assert channel.times == pytest.approx([1.0, 1.25])


def test_the_truth_of_a_simulated_base_is_recorded(tmp_path):
    """It is NaN until the first message, then the newest one."""
    bus = Bus()
    simulator = MemoryMiddleware(bus, "simulator").writer("floating_base", TRUTH_MESSAGE)
    truth = MemoryMiddleware(bus, "node").reader("floating_base", TRUTH_MESSAGE)
    plugins = Several(names=("one",)).plugins
    numbers = np.arange(13.0)
    parts = numbers[:3], np.array((0.0, 0.0, 0.6, 0.8)), numbers[7:10], numbers[10:]
    with closing(BlackBox(tmp_path, plugins, truth=truth)) as box:
        drain = RecordDrain(tmp_path)
        box.record(1_000_000_000, 0, 0)
        simulator.write(BodyMessage("world", "base", *parts))
        box.record(1_250_000_000, 0, 0)
        with closing(RecordingWriter(tmp_path / "run.mcap", {})) as writer:
            drain.into(writer).fill()
            writer.finish(drain.lost)
    channel = read(tmp_path / "run.mcap")["one/truth"]
    assert (channel.kind, channel.frame, channel.columns[:3]) == (TRUTH_MESSAGE, "world", ("x", "y", "z"))
    assert np.isnan(channel.values[0]).all()
    np.testing.assert_array_equal(channel.values[1], np.concatenate(parts))


def test_only_a_plugin_that_ran_is_held(tmp_path):
    with closing(BlackBox(tmp_path, Several(names=("one", "two")).plugins)) as box:
        drain = RecordDrain(tmp_path)
        for state in (STARTING, STARTING, RUNNING, STARTING, RUNNING, PluginState.ABORTED, STARTING):
            box.note(1, SimpleNamespace(name="two", state=state, reason=""), 0)
        events = [(event.plugin, event.kind) for event in drain.events()]
    assert events == [("two", kind) for kind in ("start", "start", "run", "hold", "run", "abort", "start")]
