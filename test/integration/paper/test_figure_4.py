"""Fig. 4 of the paper: plugins on the upper and the lower body, and an empty component on all of it merges them."""

import numpy as np
import pytest
from support.integration.xbot_world import ON_BOTH

from solfer.plugins import PluginState

WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")


@pytest.fixture
def plugins(world):
    """Run the three plugins."""
    plugins = {name: world.plugin(name) for name in ("upper_body", "lower_body", "whole_body")}
    world.run(0.3)
    assert {plugin.life for plugin in plugins.values()} == {PluginState.RUNNING}
    return plugins


@ON_BOTH
def test_the_parts_together_command_every_joint(plugins):
    upper, lower, whole = (set(np.array(plugin.robot.dofs)[plugin.robot.actuated]) for plugin in plugins.values())
    assert upper | lower == whole and not upper & lower
    assert [pipe.name for pipe, gate in plugins["whole_body"].outputs.controllers if gate] == [
        "position_controller", "velocity_controller"
    ]  # fmt: skip
    assert not any(gate for name in ("upper_body", "lower_body") for _, gate in plugins[name].outputs.controllers)


@ON_BOTH
def test_both_parts_move_at_once(world, plugins):
    whole = plugins["whole_body"].robot
    upper = world.ask("upper_body/trajectory", joints=("torso_yaw", "neck_pitch"), positions=(0.3, 0.2))
    lower = world.ask("lower_body/trajectory", state="mammal_wide_high")
    assert upper.success and lower.success
    world.run(max(upper.duration, lower.duration) + 1.0)
    assert whole.state.position[whole.dof("torso_yaw")] == pytest.approx(0.3, abs=0.02)
    assert whole.state.position[whole.dof("neck_pitch")] == pytest.approx(0.2, abs=0.02)
    indices, goal = plugins["lower_body"].robot.named_state("mammal_wide_high")
    assert np.abs(plugins["lower_body"].robot.state.position[indices] - goal).max() < 0.04
    world.ask("lower_body/trajectory", joints=WHEELS, velocities=(1.0, -1.0, 1.0, -1.0))
    world.run(1.0)
    speeds = world.simulation.v[[whole.dof(wheel) for wheel in WHEELS]]
    assert speeds == pytest.approx([1.0, -1.0, 1.0, -1.0], abs=0.02)


def go(world, plugins, speed):
    """Let both parts move [rad/s] and the wheels turn; goals of two joints of the upper body."""
    whole, joints = plugins["whole_body"].robot, ("torso_yaw", "j_arm1_4")
    goals = {joint: whole.state.position[whole.dof(joint)] + 0.4 for joint in joints}
    assert world.ask("upper_body/trajectory", joints=joints, positions=tuple(goals.values()), speed=speed).success
    assert world.ask("lower_body/trajectory", joints=WHEELS, velocities=(1.0, -1.0, 1.0, -1.0)).success
    return goals


@pytest.mark.daily(1)
@pytest.mark.parametrize("away", ["lower_body", "whole_body"])
@pytest.mark.parametrize("duration", [3.0, 0.08, 0.35, None])
def test_what_was_asked_before_is_forgotten(world, plugins, away, duration):
    """One stands still for a while, or is stopped and started anew: no plugin goes on, until a new request."""
    whole = plugins["whole_body"].robot
    wheels = [whole.dof(wheel) for wheel in WHEELS]
    part = plugins[away].robot  # a short stall concerns no other plugin: the upper body moves on as it was asked to
    stopped = [whole.dof(part.dofs[dof]) for dof in part.actuated] if duration == 0.08 else whole.actuated
    held = np.setdiff1d(stopped, wheels)
    go(world, plugins, 0.2)
    world.run(1.0)
    if duration is None:
        plugins[away].stop()
        world.run(2.5)
        plugins[away].restart()
    else:
        world.asleep.add(away)
        world.run(duration)
        world.asleep.clear()
    path, speeds, limits = [], [], whole.upper_limits.velocity
    world.bus.every(0.001, lambda: (path.append(world.simulation.q.copy()), speeds.append(world.simulation.v.copy())))
    world.run(3.0)
    assert {plugin.life for plugin in plugins.values()} == {PluginState.RUNNING}
    # until a lease has ended or the stall is seen, the robot goes on: 0.05 rad are for that, and for the braking
    assert np.abs(np.array(path) - path[0])[:, held].max() < 0.06
    assert np.abs(speeds)[1000:, wheels].max() < 0.05
    before, speeds[:] = len(speeds), []
    goals = go(world, plugins, 0.4)
    world.run(2.0)
    assert before == 3000 and {joint: whole.state.position[whole.dof(joint)] for joint in goals} == pytest.approx(
        goals, abs=0.02
    )
    assert (np.abs(speeds) / limits).max() < 0.25
    assert speeds[-1][wheels] == pytest.approx([1.0, -1.0, 1.0, -1.0], abs=0.05)
