"""Tags of a configuration that ask something of the lower level at each start: `ff_service`, gains of a file."""

import logging
import re

import numpy as np
from support.integration.world import CONFIG, ROBOT
from support.integration.xbot_world import ON_BOTH

from solfer.config import read
from solfer.lower_level.records import GainsRecord
from solfer.plugins import PluginState

SOFT = ROBOT / "hardware" / "gains.yaml"
"""Gains that differ from those that the robot begins with."""


def configured(folder, tag="", gains=SOFT):
    """Write the shipped configuration with gains, and a tag of the position controller."""
    text = (CONFIG / "centauro.yaml").read_text()
    text, found = re.subn(r"      position_controller:\n        sink: /command", rf"\g<0>\n        {tag}", text)
    assert found == 1
    if gains is not None:
        text, found = re.subn(
            r"    source: +# a word", f"    source:\n      controller: {{file: {gains}}}\n      # a word", text
        )
        assert found == 1
    (folder / "config").mkdir()
    for name in ("robots", "support"):
        (folder / "config" / name).symlink_to(CONFIG / name)
    (folder / "config/centauro.yaml").write_text(text)
    return folder / "config/centauro.yaml"


@ON_BOTH
def test_a_start_switches_feed_forward_on_and_loads_gains(world, tmp_path):
    controller = world.simulation.lower_level.controllers["position_controller"]
    controller.feed_forward = False
    plugin = world.plugin("joint_states", configured(tmp_path, "ff_service: /set_ff_torque"))
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and controller.feed_forward
    gains = read(SOFT, GainsRecord, ("centauro",)).gains
    expected = [gains[joint].stiffness for joint in controller.joints]
    np.testing.assert_allclose(controller.stiffness, expected)
    controller.feed_forward = False
    plugin.stop()
    plugin.restart()
    world.run(1.0)
    assert controller.feed_forward


def test_another_service_may_load_the_gains(world, tmp_path, caplog):
    controller = world.simulation.lower_level.controllers["position_controller"]
    before = controller.stiffness.copy()
    world.plugin("joint_states", configured(tmp_path, "load_service: /take_gains"))
    world.run(1.0)
    assert "position_controller/take_gains does not load" in caplog.text
    np.testing.assert_array_equal(controller.stiffness, before)


def test_refused_gains_are_named(world, tmp_path, caplog):
    (tmp_path / "gains.yaml").write_text("centauro: {gains: {}}\n")
    with caplog.at_level(logging.ERROR):
        plugin = world.plugin("joint_states", configured(tmp_path, gains=tmp_path / "gains.yaml"))
        world.run(1.0)
    assert plugin.life is PluginState.RUNNING
    assert f"load_gains does not load {tmp_path}/gains.yaml: " in caplog.text
    assert "is not a file that may be read" in caplog.text


def test_an_idle_plugin_asks_for_nothing(world, tmp_path):
    controller = world.simulation.lower_level.controllers["position_controller"]
    controller.feed_forward = False
    file = configured(tmp_path, "ff_service: /set_ff_torque")
    file.write_text(file.read_text().replace("      mode: full             # `idle`", "      mode: idle   # `idle`"))
    plugin = world.plugin("joint_states", file)
    world.run(0.5)
    assert plugin.life is PluginState.RUNNING and not controller.feed_forward
