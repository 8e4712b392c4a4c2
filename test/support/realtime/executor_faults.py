"""What several tests of executor faults share."""

import pytest
from support.integration.world import CONFIG
from support.integration.xbot_system import REPOSITORY, XbotSystem, until

from solfer.plugins import PluginState
from solfer.telemetry.statistics import RuntimeStatistics

SPEED = 2.0  # [rad/s]


@pytest.fixture
def layer(tmp_path):
    file = tmp_path / "layer.yaml"
    file.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {CONFIG / "centauro.yaml"}}}
executor: {{start: [joint_states], blend: 0.1, overruns: 1000000, schedule: {{lock_memory: false}}}}
""")
    return file


def begin(robot: XbotSystem, file) -> tuple:
    """Start the node, and wait until its plugin runs; returns its process and its statistics."""
    process = robot.start(REPOSITORY / "nodes" / "xbot", str(file), "--namespace", robot.name)
    until(lambda: robot.state() is PluginState.RUNNING, "a plugin that runs")
    return process, RuntimeStatistics.attach(robot.namespace.folder)
