"""Emergency stop of the simulated CENTAURO while a plugin drives it."""

import numpy as np
import pytest
from support.plugins.plugin import WHEELS

from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.transport import JointMessage


@pytest.fixture
def driven(world):
    """Run a plugin that turns the wheels."""
    plugin = world.plugin("joint_states")
    world.run(0.5)
    assert world.ask(joints=WHEELS, velocities=(2.0,) * 4).success
    world.run(1.0)
    return plugin


def speeds(world):
    """Of the wheels [rad/s]."""
    return world.simulation.v[[world.simulation.kinematics.dofs.index(name) for name in WHEELS]]


@pytest.mark.soak
def test_an_emergency_stop_ends_by_its_service(world, driven):
    lower_level, body = world.simulation.lower_level, world.simulation.body
    assert world.ask("lower_level/emergency_stop").success
    world.run(0.3)
    assert np.abs(speeds(world)).max() < 0.1
    height, fastest = body.position[2], 0.0
    for _ in range(400):
        world.run(0.01)
        fastest = max(fastest, float(np.abs(body.linear).max()))
    assert lower_level.emergency and lower_level.emergency.factor == 0.0
    assert body.position[2] < height - 0.1  # without springs it sinks to the ground,
    assert fastest < 1.5  # slower than it would fall
    assert world.bus.reports["lower_level"].level == 2
    assert driven.life is PluginState.STARTING and 0 < lower_level.refusals["joint_states"] < 50  # it has understood


def test_an_unnoticed_refusal_stays(world):
    lower_level = world.simulation.lower_level
    writer = MemoryMiddleware(world.bus, "deaf").writer("position_controller/command", "solfer/JointCommand")
    world.bus.every(0.01, lambda: writer.write(JointMessage(("torso_yaw",), position=np.array([0.5]))))
    world.run(0.05)
    world.ask("lower_level/emergency_stop")
    world.run(1.0)
    assert world.ask("lower_level/reset_emergency_stop").success
    springs = lower_level.controllers["position_controller"]
    target = springs.position.copy()
    world.run(1.0)
    assert np.array_equal(springs.position, target) and lower_level.claims.owners() == ()
    assert lower_level.refusals["deaf"] > 190


def test_a_plugin_goes_on_after_a_reset(world, driven):
    """References restart at the measured posture, so nothing jumps, and the old wheel speeds do not come back."""
    world.ask("lower_level/emergency_stop")
    world.run(1.0)
    assert world.ask("lower_level/reset_emergency_stop").success
    springs = world.simulation.lower_level.controllers["position_controller"]
    assert np.abs(springs.target - world.simulation.q[springs.dofs]).max() < 0.05
    before = world.simulation.q.copy()
    world.run(0.5)
    assert driven.life is PluginState.RUNNING and not driven.robot.command.velocity.any()
    assert np.abs(springs.target - world.simulation.q[springs.dofs]).max() < 0.05
    world.run(1.5)
    assert np.abs(world.simulation.q[springs.dofs] - before[springs.dofs]).max() < 0.05
    before = world.simulation.q.copy()
    world.run(1.0)
    assert np.abs(world.simulation.q - before).max() < 2e-3
    assert np.abs(speeds(world)).max() < 0.05
    assert world.ask(joints=WHEELS, velocities=(1.0,) * 4).success
    world.run(1.0)
    assert np.abs(speeds(world) - 1.0).max() < 0.1
    driven.stop()
    driven.close()
