"""Who commands the simulated CENTAURO: a second claimant, one that dies, and wrong commands, on the virtual clock."""

import copy

import numpy as np
import pytest
from support.integration.world import STEP
from support.plugins.plugin import WHEELS
from support.plugins.plugin_claims import command, dofs, drive, kill, owners
from support.plugins.plugin_refused import joints

from solfer.errors import ClaimRefused
from solfer.plugins import PluginState

SECONDS = 3.0  # until a robot with stopped wheels stands still


def test_a_plugin_claims_before_and_releases_after(world):
    plugin = world.plugin("joint_states")
    assert owners(world) == {"position_controller": "", "velocity_controller": ""}
    world.run(0.1)
    assert plugin.life is PluginState.RUNNING
    assert all(published.startswith("joint_states: ") for published in owners(world).values())
    plugin.stop()
    world.run(2 * STEP)
    assert set(owners(world).values()) == {""}


def test_a_start_with_a_wrong_posture_is_refused(world):
    """The robot rests, and the joint is named; what is measured after a reset is compared with nothing from before."""
    line = world.bus.topic("joint_states", "sensor_msgs/JointState")
    publish, wrong = line.publish, [0.3]

    def changed(message, sender, now):
        shifted = copy.deepcopy(message)
        shifted.position[message.names.index("hip_pitch_1")] += wrong[0]
        publish(shifted, sender, now)

    line.publish = changed
    world.run(1.0)
    plugin, before = world.plugin("joint_states"), joints(world)
    world.run(1.0)
    level, summary = plugin.health()
    assert plugin.life is PluginState.STARTING and level == 2 and set(owners(world).values()) == {""}
    for part in ("'hip_pitch_1' is measured at", "'position_controller' holds it at", "an encoder that agrees"):
        assert part in summary
    assert np.abs(joints(world) - before).max() < 0.001
    wrong[0] = 0.0
    world.run(1.0)
    assert plugin.life is PluginState.STARTING and "refuses messages of simulator" in plugin.health()[1]
    assert world.ask("simulator/reset").success
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and plugin.health() == (0, "running")


def test_a_second_claimant_is_refused(world):
    first = drive(world)
    second = world.plugin("joint_lower")
    with pytest.raises(ClaimRefused) as refusal:
        world.run(1.0)
    for name in ("'joint_lower'", "'joint_states'", "hip_yaw_1"):
        assert name in str(refusal.value)
    assert refusal.value.exit_code == 2 and second.life is PluginState.STARTING
    second.stop()
    second.close()
    refused = world.simulation.lower_level.refused
    world.run(1.0)
    assert first.life is PluginState.RUNNING and world.simulation.lower_level.refused == refused == 0
    assert np.abs(world.simulation.v[dofs(world)] - 2.0).max() < 0.05


def test_a_publisher_claims_only_free_joints(world):
    plugin = world.plugin("joint_lower")
    world.run(0.3)
    for _ in range(100):
        command(world, "publisher", "position_controller", ("neck_yaw",), position=[0.2])
        command(world, "publisher", "velocity_controller", WHEELS, velocity=[3.0] * 4)
        world.run(0.01)
    assert world.simulation.q[dofs(world, ["neck_yaw"])[0]] == pytest.approx(0.2, abs=0.01)
    assert np.abs(world.simulation.v[dofs(world)]).max() < 0.05
    assert world.simulation.lower_level.refusals == {"publisher": 100}
    published = owners(world)["position_controller"]
    assert plugin.life is PluginState.RUNNING and "joint_lower: " in published and "publisher: position" in published


def test_a_killed_claimant_leaves_free_resting_joints(world):
    plugin = drive(world)
    kill(plugin)
    world.run(0.3)
    assert set(owners(world).values()) == {""}  # within 0.32 s
    wheels = dofs(world)
    world.run(SECONDS)
    before, joints = world.simulation.body.position.copy(), world.simulation.q[6:].copy()
    assert np.abs(world.simulation.v[wheels]).max() < 0.02
    world.run(2.0)
    assert np.abs(world.simulation.body.position - before).max() < 1e-3
    assert np.abs(world.simulation.q[6:] - joints).max() < 2e-3
    command(world, "other", "velocity_controller", WHEELS, velocity=[0.5] * 4)
    world.run(0.01)
    assert owners(world)["velocity_controller"] == "other: velocity"
