"""Figures of a real-time layer as messages."""

from solfer.ros_statistics import message_of
from solfer.telemetry.summaries import LayerSummary, PluginSummary, StageSummary


def test_figures_become_the_fields_of_messages():
    stage = StageSummary("read", 7, 1e-6, 2e-6, 3e-6, 4)
    plugin = PluginSummary("arm", "RUNNING", "", 1, 2, 3, {"kinematics": 5}, (stage,))
    message = message_of(LayerSummary(42, True, 500.0, "FIFO", "", 10, 11, 12, 13, (stage,), (plugin,)))
    assert (message.process, message.rate, message.skipped, message.unforgiven) == (42, 500.0, 11, 13)
    (sent,) = message.plugins
    assert (sent.name, sent.stage, sent.starts, sent.over_budget) == ("arm", "RUNNING", 1, 3)
    assert [each.name for each in (*message.loop, *sent.stages)] == ["read", "read"]
    assert (sent.stages[0].count, sent.stages[0].median, sent.stages[0].skipped) == (7, 1e-6, 4)
