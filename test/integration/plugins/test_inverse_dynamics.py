"""CENTAURO on the torques of `inverse_dynamics`: it squats, and its wheels keep their grip."""

import contextlib

import numpy as np
from support.integration.world import World

from solfer.plugins import PluginState

FRICTION = 0.8
WHEELS = tuple(f"wheel_{leg}" for leg in range(1, 5))


def test_squats_follow_their_reference_within_friction_and_torques():
    with contextlib.closing(World()) as world:
        world.run(0.3)
        plugin = world.plugin("squat")
        component, simulation = plugin.component, world.simulation
        before, errors, heights, grips, torques = simulation.torque.copy(), [], [], [], []

        def look():
            com = component.tasks["com"]
            errors.append(com.point.value - com.reference.value)
            heights.append(float(com.point.value[2]))
            forces = np.array([simulation.contacts()[link] for link in WHEELS])
            grips.append(np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2])
            torques.append(simulation.torque.copy())

        world.run(0.01)
        world.bus.every(0.005, look)
        world.run(6.0)
        moved = np.array(torques)
        assert plugin.life is PluginState.RUNNING and not component.is_holding
        assert np.sqrt(np.mean(np.sum(np.square(errors), axis=1))) < 0.005
        assert max(heights) - min(heights) > 0.095
        assert np.max(grips) < FRICTION
        assert (np.abs(moved) <= simulation.kinematics.effort_limit).all()
        # it takes over what springs carried, without a jump
        assert np.abs(moved[:20] - before)[:, 6:].max() < 25.0
