"""Fig. 4 of the paper: plugins on the upper and the lower body, and an empty component on all of it merges them."""

import numpy as np
import pytest
from xbot_world import ON_BOTH

from solfer.plugins import Life

WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")


@pytest.fixture
def plugins(world):
    """The three plugins, running."""
    plugins = {name: world.plugin(name) for name in ("upper_body", "lower_body", "whole_body")}
    world.run(0.3)
    assert {plugin.life for plugin in plugins.values()} == {Life.RUNNING}
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


@pytest.mark.parametrize("away", ["lower_body", "whole_body"])
def test_who_merges_catches_up_at_a_part_of_the_speed_limits(world, plugins, away):
    """The upper body moves on while the lower body is away, and who merges holds; or while that is away itself."""
    whole, joints = plugins["whole_body"].robot, ("torso_yaw", "j_arm1_4")
    limits, fastest = whole.upper_limits.velocity, np.zeros(whole.size)
    world.bus.every(0.001, lambda: np.maximum(fastest, np.abs(world.simulation.v) / limits, out=fastest))
    goals = [whole.state.position[whole.dof(joint)] + 0.4 for joint in joints]
    reply = world.ask("upper_body/trajectory", joints=joints, positions=goals, speed=0.2)
    plugins[away].stop()
    world.run(reply.duration)
    assert plugins["whole_body"].life is not Life.RUNNING
    missing = [goal - whole.state.position[whole.dof(joint)] for joint, goal in zip(joints, goals, strict=True)]
    assert min(missing) > 0.3
    fastest[:] = 0.0
    plugins[away].restart()
    world.run(3.0)
    assert [whole.state.position[whole.dof(joint)] for joint in joints] == pytest.approx(goals, abs=0.02)
    # a spring behind a target that moves swings by some percent
    assert 0.15 < max(fastest[whole.dof(joint)] for joint in joints) < 0.22
    assert fastest.max() < 0.25


@ON_BOTH
def test_nothing_is_sent_before_both_parts_speak(world):
    world.plugin("upper_body")
    whole = world.plugin("whole_body")
    before = world.simulation.q.copy()
    world.run(0.5)
    assert whole.life is Life.WAITING
    assert np.abs(world.simulation.q - before).max() < 0.01
