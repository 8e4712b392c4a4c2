"""A plugin against the simulated CENTAURO: from the configuration to the motion, and what happens when parts fail."""

import numpy as np
import pytest
from support.integration.xbot_world import ON_BOTH
from support.plugins.plugin import WHEELS, Saboteur, configuration

from solfer.config import load
from solfer.errors import ComponentError, MiddlewareError, NotFinite
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate, run


@ON_BOTH
def test_centauro_obeys_the_service(world):
    plugin = world.plugin("joint_states")
    world.run(0.1)
    assert plugin.life is PluginState.RUNNING
    reply = world.ask(state="mammal_wide_high")
    assert reply.success and reply.duration > 0.5
    low = world.simulation.body.position[2]
    world.run(reply.duration + 1.0)
    indices, goal = plugin.robot.named_state("mammal_wide_high")
    assert np.abs(plugin.robot.command.position[indices] - goal).max() < 1e-9
    # what is left is the springs' give under the weight and the friction of the wheels
    assert np.abs(plugin.robot.state.position[indices] - goal).max() < 0.04
    assert world.simulation.body.position[2] - low > 0.05
    assert len(world.simulation.contact_links()) == 4


@ON_BOTH
def test_a_refused_request_moves_nothing(world):
    world.plugin("joint_states")
    world.run(2.0)
    before = world.simulation.q.copy()
    reply = world.ask(joints=("torso_jaw",), positions=(0.2,))
    assert not reply.success and "did you mean: torso_yaw" in reply.message
    world.run(0.5)
    assert np.abs(world.simulation.q - before).max() < 5e-4


def test_what_comes_too_early_is_answered(world):
    world.received = True
    plugin = world.plugin("joint_states")
    early = world.bus.call("joint_states/trajectory", state="home")
    plugin.inbox.apply()
    with pytest.raises(MiddlewareError, match="waits for feedback 'link_side_online'"):
        early.result(0)


@ON_BOTH
def test_lost_feedback_stops_the_wheels(world):
    plugin = world.plugin("joint_states")
    world.run(0.2)
    world.ask(joints=WHEELS, velocities=(2.0, -2.0, 2.0, -2.0))
    world.run(1.0)
    wheels = [plugin.robot.dof(wheel) for wheel in WHEELS]
    assert np.abs(world.simulation.v[wheels]).min() > 1.9
    world.received = False
    world.run(0.3)
    assert plugin.life is PluginState.STARTING and not plugin.robot.command.velocity.any()
    world.received = True
    world.run(0.5)
    assert plugin.life is PluginState.RUNNING
    assert np.abs(world.simulation.v[wheels]).max() < 0.05
    assert world.ask(state="mammal_wide_high").success


@ON_BOTH
def test_stop_leaves_wheels_at_zero_and_joints_held(world):
    plugin = world.plugin("joint_states")
    world.run(0.2)
    world.ask(joints=WHEELS, velocities=(2.0, -2.0, 2.0, -2.0))
    world.ask(state="mammal_wide_high")
    world.run(0.6)
    plugin.stop()
    plugin.close()
    target = world.simulation.lower_level.controllers["position_controller"].position.copy()
    world.run(2.0)
    wheels = [plugin.robot.dof(wheel) for wheel in WHEELS]
    assert np.abs(world.simulation.v[wheels]).max() < 1e-2
    assert np.array_equal(world.simulation.lower_level.controllers["position_controller"].position, target)


@pytest.mark.daily(1)
@pytest.mark.parametrize("step", ["init", "update", "send", "nan"])
def test_a_failing_component_leaves_the_robot_at_rest(world, tmp_path, monkeypatch, step):
    """An exception or a NaN closes the plugin with its name in the error, and no joint drifts for a second after."""
    monkeypatch.setattr(Saboteur, "step", step)
    file = configuration(tmp_path, **{"class": "support.plugins.plugin:Saboteur"})
    middleware = MemoryMiddleware(world.bus, "test")
    plugin = generate(load(file, "test"), middleware, Registry().find("test", f"{__name__}:Saboteur"))
    with pytest.raises(ComponentError, match="'test' failed, the robot holds") as caught:
        run(plugin, middleware)
    assert caught.value.exit_code == 1 and plugin.life is PluginState.CLOSED
    if step == "nan":
        assert isinstance(caught.value.__cause__, NotFinite) and "torso_yaw" in str(caught.value)
    before = world.simulation.q.copy()
    world.run(1.0)
    wheels = [plugin.robot.dof(wheel) for wheel in WHEELS]
    assert np.abs(world.simulation.v[wheels]).max() < 1e-2
    joints = np.setdiff1d(plugin.robot.actuated, wheels)
    assert np.abs(world.simulation.q[joints] - before[joints]).max() < 0.02


@ON_BOTH
def test_a_partial_model_moves_its_part_only(world):
    plugin = world.plugin("joint_lower")
    world.run(0.1)
    assert plugin.robot.size == 30 and "torso_yaw" not in plugin.robot.dofs
    reply = world.ask("joint_lower/trajectory", state="mammal_wide_high")
    assert reply.success
    world.run(reply.duration + 1.0)
    indices, goal = plugin.robot.named_state("mammal_wide_high")
    assert np.abs(plugin.robot.state.position[indices] - goal).max() < 0.04
    reply = world.ask("joint_lower/trajectory", joints=("torso_yaw",), positions=(0.1,))
    assert not reply.success and "unknown joint 'torso_yaw'" in reply.message
