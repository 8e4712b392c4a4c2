"""Figs. 3 and 4 of the paper with gravity compensation, which one tag puts on the measured or the desired state."""

import contextlib
import re

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG, World
from support.integration.xbot_world import XbotWorld
from support.paper.figure_3 import write_offline

from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer_tools.navigation.course import twist

JOINTS = ("j_arm1_4", "torso_yaw")


def commands(world, mover, merging, file):
    """Let a plugin move joints through one that carries the robot; what that commands cycle by cycle, and itself."""
    movers = [world.plugin(name) for name in mover]
    plugin = world.plugin(merging, file)
    sent, cycle = [], plugin.outputs.send

    def note(stamp):
        cycle(stamp)
        pipes = plugin.outputs.commanding
        sent.append(np.concatenate([values for pipe in pipes for _, values in pipe.fields]))

    plugin.outputs.send = note
    world.run(0.6)
    here = [plugin.robot.state.position[plugin.robot.dof(joint)] for joint in JOINTS]
    goals = tuple(place + 0.1 for place in here)
    assert world.ask(f"{mover[0]}/trajectory", joints=JOINTS, positions=goals, speed=0.5).success
    world.run(0.6)
    assert {each.life for each in (*movers, plugin)} == {PluginState.RUNNING}
    moved = world.simulation.q[[plugin.robot.dof(joint) for joint in JOINTS]]
    assert moved == pytest.approx(goals, abs=0.02)
    return np.array(sent), plugin


def in_both(mover, merging, file, folder):
    """Move joints in memory and in shared memory by the same commands to the last digits; yield what carries."""
    runs = []
    for world in (World(), XbotWorld(folder)):
        with contextlib.closing(world):
            height = world.simulation.q[2]
            sent, plugin = commands(world, mover, merging, file)
            lower_level, hip = world.simulation.lower_level.controllers["position_controller"], "hip_pitch_1"
            applied = lower_level.applied_effort[lower_level.joints.index(hip)]
            assert applied == pytest.approx(plugin.robot.command.torque[plugin.robot.dof(hip)], abs=1.0)
            assert abs(world.simulation.q[2] - height) < 0.01
        runs.append(sent)
        yield plugin
    count = min(map(len, runs))
    assert count > 200 and np.abs(runs[0][:count] - runs[1][:count]).max() < 1e-9
    assert np.abs(runs[0]).max() > 30.0


@pytest.mark.daily(1)
@pytest.mark.parametrize("state", ["online", "offline"])
def test_one_tag_chooses_the_state_that_is_carried(state, tmp_path):
    """The same commands to the last digits in memory and in shared memory."""
    file = write_offline(tmp_path) if state == "offline" else CONFIG / "centauro.yaml"
    for plugin in in_both(("desired_joints",), "gravity_compensation", file, tmp_path):
        state_, desired = plugin.robot.state.position[6:], plugin.robot.command.position[6:]
        assert np.array_equal(state_, desired) == (state == "offline")


@pytest.mark.soak
def test_figure_4_carries_what_both_parts_want(tmp_path):
    shipped = CONFIG / "centauro.yaml"
    for plugin in in_both(("upper_body", "lower_body"), "shared_compensation", shipped, tmp_path):
        hip = plugin.robot.command.torque[plugin.robot.dof("hip_pitch_1")]
        assert abs(hip) > 5.0


def test_figure_3_begins_with_inverse_kinematics(repository):
    """The request of the page lowers the robot, which gravity compensation carries."""
    text = (repository / "docs/tutorials/figures.md").read_text()
    (request,) = re.findall(r'^rosservice call /desired_tasks/reference "(.*)"$', text, re.MULTILINE)
    fields = yaml.safe_load(request) | {"values": tuple(yaml.safe_load(request)["values"])}
    with contextlib.closing(World()) as world:
        height = world.simulation.q[2]
        plugins = [world.plugin(name) for name in ("desired_tasks", "gravity_compensation")]
        world.run(0.6)
        assert world.ask("desired_tasks/reference", **fields).success
        world.run(1.5)
        assert {each.life for each in plugins} == {PluginState.RUNNING}
        # hands stay, so the base sinks more than the centre of mass
        assert -0.06 < world.simulation.q[2] - height < -0.02


def test_figure_4_drives_by_the_shipped_modules():
    """Locomotion drives the legs, manipulation holds the arms, and one plugin commands all joints."""
    with contextlib.closing(World()) as world:
        plugins = [world.plugin("hands"), world.plugin("odometry", target="solfer.components.odometry:Odometry")]
        plugins += [world.plugin("locomotion"), world.plugin("shared_compensation")]
        world.run(1.0)
        writer = MemoryMiddleware(world.bus, "driver").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
        before = world.simulation.q[0]
        for _ in range(15):
            writer.write(twist(0.1, 0.0, 0.0))
            world.run(0.1)
        assert {each.life for each in plugins} == {PluginState.RUNNING}
        assert world.simulation.q[0] - before > 0.05
