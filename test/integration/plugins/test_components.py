"""Several components in one node on the simulated CENTAURO: each owns its joints, and gives back no others."""

import numpy as np
import pytest
from support.integration.xbot_world import ON_BOTH
from support.plugins.components import NODE, Node, parts
from support.plugins.plugin import WHEELS
from support.plugins.plugin_claims import dofs, kill

from solfer.errors import ClaimRefused
from solfer.plugins import PluginState
from solfer.transport import JointMessage

SPRINGS, DRIVES = f"{NODE}#springs: position, effort", f"{NODE}#drives: velocity"


@ON_BOTH
def test_a_component_returns_its_own_joints_only(world, tmp_path):
    node = Node(world, parts(tmp_path), ("springs", "drives"))
    world.run(0.3)
    assert node.owners() == (SPRINGS, DRIVES)
    node.drive()
    node.plugins["springs"].stop()
    world.run(0.5)  # longer than a lease: each renews its own
    assert node.owners() == ("", DRIVES) and node.plugins["drives"].life is PluginState.RUNNING
    assert np.abs(world.simulation.v[dofs(world)] - 2.0).max() < 0.05
    node.plugins["springs"].restart()
    world.run(0.3)
    assert node.owners() == (SPRINGS, DRIVES) and not world.simulation.lower_level.refusals


@ON_BOTH
def test_a_second_component_is_refused(world, tmp_path):
    node = Node(world, parts(tmp_path), ("drives",))
    world.run(0.3)
    node.drive()
    second = node.add("all_of_it")
    with pytest.raises(ClaimRefused, match="'all_of_it'") as refusal:
        world.run(1.0)
    for name in (f"'{NODE}#all_of_it' cannot command", "j_wheel_1", f"'{NODE}#drives' does"):
        assert name in str(refusal.value)
    assert refusal.value.exit_code == 2 and second.life is PluginState.STARTING
    second.stop()
    second.close()
    world.run(0.5)
    assert node.owners() == ("", DRIVES) and node.plugins["drives"].life is PluginState.RUNNING
    assert np.abs(world.simulation.v[dofs(world)] - 2.0).max() < 0.05


def test_no_sibling_renews_a_lease(world, tmp_path):
    node = Node(world, parts(tmp_path), ("springs", "drives"))
    world.run(0.3)
    kill(node.plugins["drives"])
    world.run(0.35)
    assert node.owners() == (SPRINGS, "")


@pytest.mark.daily(1)
@pytest.mark.parametrize("component", ["", "springs", "drives2"])
def test_a_stray_command_of_the_node_is_refused(world, tmp_path, component):
    node = Node(world, parts(tmp_path), ("springs", "drives"))
    world.run(0.3)
    writer = node.middleware.writer("velocity_controller/command", "solfer/JointCommand")
    writer.write(JointMessage(WHEELS, velocity=np.ones(4), component=component))
    world.run(0.01)
    stray = f"{NODE}#{component}" if component else NODE
    assert world.simulation.lower_level.refusals == {stray: 1}
    assert world.simulation.lower_level.controllers["velocity_controller"].velocity.max() == 0.0
    assert all(plugin.life is PluginState.RUNNING for name, plugin in node.plugins.items() if name != component)
