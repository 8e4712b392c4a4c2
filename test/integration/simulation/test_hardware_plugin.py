"""`system: SM -> HW`: the same plugin on the simulated robot and on hardware that counts its joints otherwise.

`middleware: ROS -> XBOT` changes as little; in memory stands for ROS.

The reference is the physical posture, which no pipe has touched.
"""

import re

import numpy as np
import pytest
from support.integration.world import World
from support.integration.xbot_world import XbotWorld
from support.realtime.executor_plugins import Layer
from support.simulation.hardware_plugin import HardwareWorld, configuration, mocked

from solfer.config import load
from solfer.errors import OutOfLimits, SolferError
from solfer.plugins import PluginState

UNLOADED, LOADED = 0.035, 0.1
"""How far the hardware's soft springs give way to gravity [rad]."""

SHIFT = 0.06
"""What the encoders of another robot read at the model's zero, more or less than those of this one [rad]."""

WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")


class XbotHardwareWorld(XbotWorld):
    """The hardware in shared memory."""

    serve = staticmethod(mocked)


MEMORY, SHARED = {"SM": World, "HW": HardwareWorld}, {"SM": XbotWorld, "HW": XbotHardwareWorld}


@pytest.fixture
def make(request, tmp_path):
    """Return a function that makes the world of a system and a middleware."""

    def make(system, middleware="ROS"):
        world = MEMORY[system]() if middleware == "ROS" else SHARED[system](tmp_path)
        request.addfinalizer(world.close)
        return world

    return make


def another_robots(text):
    """Make all offsets of a calibration a bit wrong, alternately too large and too small."""
    parts = re.split(r"offset: (-?[\d.]+)", text)
    offsets = [float(part) + SHIFT * (-1) ** index for index, part in enumerate(parts[1::2])]
    assert len(offsets) == 42
    return "".join(part if index % 2 == 0 else f"offset: {offsets[index // 2]:g}" for index, part in enumerate(parts))


def physical(world, robot, joints):
    """Positions of joints as they really are [rad]."""
    return np.array([world.simulation.q[robot.dof(joint)] for joint in joints])


def target(world, joints):
    """Positions that the drives really hold [rad]."""
    controller = world.simulation.lower_level.controllers["position_controller"]
    return np.array([controller.position[controller.joints.index(joint)] for joint in joints])


@pytest.mark.daily(1)
@pytest.mark.parametrize("middleware", ["XBOT", "ROS"])
@pytest.mark.parametrize("system", ["HW", "SM"])
def test_system_alone_moves_plugins_to_hardware(make, tmp_path, system, middleware):
    """Named state, single joints and wheels reach the same physical goals, whatever the encoders count.

    The springs give way a little, the targets are exact.
    """
    world = make(system, middleware)
    plugin = world.plugin("joint_states", configuration(tmp_path, system))
    robot = plugin.robot
    world.run(0.5)
    assert plugin.life is PluginState.RUNNING

    reply = world.ask(state="mammal_wide_high")
    assert reply.success, reply.message
    world.run(reply.duration + 1.0)
    goal = robot.semantics.states["mammal_wide_high"]
    joints = [joint for joint in goal if joint not in WHEELS]
    desired = np.array([goal[joint] for joint in joints])
    assert len(joints) == 35
    np.testing.assert_allclose(target(world, joints), desired, atol=1e-9)
    give = np.array([LOADED if joint.startswith(("hip", "knee", "ankle")) else UNLOADED for joint in joints])
    assert (np.abs(physical(world, robot, joints) - desired) < give).all()
    assert len(world.simulation.contact_links()) == 4

    single = {"torso_yaw": 0.3, "j_arm1_1": 0.2, "j_arm2_1": 0.1, "neck_yaw": -0.4}
    reply = world.ask(joints=tuple(single), positions=tuple(single.values()))
    assert reply.success, reply.message
    world.run(reply.duration + 1.0)
    np.testing.assert_allclose(target(world, single), list(single.values()), atol=1e-9)
    assert np.abs(physical(world, robot, single) - list(single.values())).max() < UNLOADED

    reply = world.ask(joints=WHEELS, velocities=(1.0, -1.0, 2.0, -2.0))
    assert reply.success, reply.message
    world.run(1.5)
    speeds = world.simulation.v[[robot.dof(wheel) for wheel in WHEELS]]
    np.testing.assert_allclose(speeds, (1.0, -1.0, 2.0, -2.0), atol=0.02)
    assert world.simulation.lower_level.refused == 0


def test_hardware_torques_agree_with_the_simulation(make, tmp_path):
    world = make("HW")
    plugin = world.plugin("joint_states", configuration(tmp_path, "HW"))
    world.run(3.0)
    state, joints = plugin.robot.state, plugin.robot.actuated
    truth = world.simulation
    assert np.abs(state.position[joints] - truth.q[joints]).max() < 5e-3  # wheels creep, and there is noise
    assert np.abs(truth.torque[joints]).max() > 40.0
    assert np.abs(state.torque[joints] - truth.torque[joints]).max() < 3.0


def test_another_calibration_leads_to_another_posture(make, tmp_path):
    """Shifted encoder offsets in the file shift each target by exactly sign times shift, so the file truly counts."""
    world = make("HW")
    file = configuration(tmp_path, "HW", another_robots)
    plugin = world.plugin("joint_states", file)
    world.run(0.5)
    reply = world.ask(state="mammal_wide_high")
    assert reply.success, reply.message
    world.run(reply.duration + 1.0)
    goal = plugin.robot.semantics.states["mammal_wide_high"]
    joints = [joint for joint in goal if joint not in WHEELS]
    desired = np.array([goal[joint] for joint in joints])
    entries = load(file, "joint_states").calibrations["encoders"].joints
    signs = np.array([entries[joint].sign for joint in joints])
    places = np.array([list(entries).index(joint) for joint in joints])
    # h = s q + o', and really q = s (h - o): every drive holds s (o' - o) beside the goal
    wrong = target(world, joints) - desired
    np.testing.assert_allclose(wrong, signs * SHIFT * (-1.0) ** places, atol=1e-9)
    torso = joints.index("torso_yaw")
    reached = physical(world, plugin.robot, joints)[torso] - desired[torso]
    assert reached == pytest.approx(wrong[torso], abs=0.01) and abs(reached) > SHIFT - 0.01


def test_hardware_lacks_the_simulations_joint_names(make, tmp_path):
    world = make("HW")
    with pytest.raises(SolferError, match="carries no DoF"):
        world.plugin("joint_states", configuration(tmp_path, "SM"))


def test_a_part_uses_only_its_calibration(make, tmp_path):
    world = make("HW")
    plugin = world.plugin("joint_lower", configuration(tmp_path, "HW"))
    world.run(0.3)
    assert plugin.life is PluginState.RUNNING and plugin.robot.size == 30
    before = target(world, ["torso_yaw", "j_arm1_1"])
    goal = {"hip_yaw_1": -0.2, "hip_yaw_2": 0.2}
    reply = world.ask("joint_lower/trajectory", joints=tuple(goal), positions=tuple(goal.values()))
    assert reply.success, reply.message
    world.run(reply.duration + 0.1)
    np.testing.assert_allclose(target(world, goal), list(goal.values()), atol=1e-9)
    np.testing.assert_array_equal(target(world, ["torso_yaw", "j_arm1_1"]), before)


def test_wrong_zeros_keep_plugins_from_starting(make, tmp_path):
    """Where an encoder measures the knee at 5 rad, no plugin starts: neither alone nor in a real-time layer."""
    world = make("HW")
    before = world.simulation.q.copy()

    def wrong(text):
        return re.sub(r"(knee_pitch_1: .*offset: )[-\d.]+", r"\g<1>-6.2", text)

    file = configuration(tmp_path, "HW", wrong)
    with pytest.raises(OutOfLimits) as caught:
        world.plugin("joint_states", file)
        world.run(0.5)
    assert re.search(
        r"'link_side_online'.*'knee_pitch_1' is \d\.\d+ rad, beyond its upper limit 2\.399 rad", caught.value.what
    )
    assert "hardware.yaml:" in caught.value.where
    layer = Layer(HardwareWorld(), tmp_path / "layer", [("joint_states", file), ("joint_lower", file)])
    for name in ("joint_states", "joint_lower"):
        layer.world.ask(f"xbotcore/{name}_switch", data=True)
        layer.world.run(0.5)
        assert layer[name].state is PluginState.ABORTED and "'knee_pitch_1'" in layer[name].reason
    assert np.abs(world.simulation.q - before).max() < 0.01
    layer.world.close()
