"""CENTAURO on soft springs, and without any in its arms: torques of the plugin carry it, the start included."""

import contextlib

import numpy as np
import pytest
from support.integration.carried import CarriedWorld, free_arms
from support.integration.world import World

from solfer.plugins import PluginState


def test_soft_legs_do_not_sag_under_a_payload():
    world = CarriedWorld(payload=5.0)
    try:
        world.run(0.3)
        world.heights.clear()
        plugin = world.plugin("soft_compensation")
        world.run(2.0)
        controller = world.simulation.lower_level.controllers["position_controller"]
        stiffness, joints = controller.stiffness, controller.joints
        assert plugin.life is PluginState.RUNNING and world.sag() < 0.005
        legs = [joints.index(f"knee_pitch_{leg}") for leg in range(1, 5)]
        assert stiffness[legs] == pytest.approx(300.0) and stiffness[joints.index("j_arm2_3")] == pytest.approx(50.0)
    finally:
        world.close()


def test_a_hand_stays_where_it_was_pushed(tmp_path):
    world = CarriedWorld(friction=False)
    try:
        world.run(0.2)
        world.plugin("soft_compensation", free_arms(tmp_path))
        world.run(1.0)
        assert world.push_aside(0.1, np.array([0.0, 0.6, 0.8])) >= 0.1
        world.run(1.8)  # rotors and links come to rest on their dampers
        before = world.hand()
        world.run(1.0)
        assert np.linalg.norm(world.hand() - before) < 0.002  # 2 cm in 10 s
    finally:
        world.close()


def held(*plugins):
    """Hold CENTAURO where it stands by plugins; return how far its arms are from their commands in the end [rad]."""
    with contextlib.closing(World()) as world:
        commanding, *_ = [world.plugin(name) for name in plugins]
        world.run(1.6)
        arms = np.array([name.startswith("j_arm") for name in commanding.robot.dofs])
        assert np.abs(world.simulation.torque[arms]).max() > 10.0
        return np.linalg.norm((world.simulation.q - commanding.robot.command.position)[arms])


@pytest.mark.soak
def test_links_are_where_springs_are_compensated():
    without = held("desired_joints", "gravity_compensation")
    compensated = held("desired_joints", "spring_compensation", "compliance_compensation")
    assert without > 0.002 and compensated < 0.1 * without
