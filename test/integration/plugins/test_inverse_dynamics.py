"""Robots on the torques of `inverse_dynamics`: they squat, and their feet keep their grip."""

import contextlib

import numpy as np
import pytest
from support.integration.torque_robot import FRICTION, LEGGED, opened
from support.integration.world import World

from solfer.plugins import PluginState

WHEELS, GRIP = tuple(f"wheel_{leg}" for leg in range(1, 5)), 0.8
"""Wheels of CENTAURO, and the friction below them."""


class Watch:
    """What a robot does while it squats.

    Args:
        bus: The bus of plugin and simulation.
        plugin: The plugin.
        simulation: The simulation.
    """

    def __init__(self, bus, plugin, simulation):
        self._com, self._simulation = plugin.component.tasks["com"], simulation
        self.errors, self.heights, self.grips, self.torques = [], [], [], []
        bus.every(0.005, self._look)

    def _look(self):
        self.errors.append(self._com.point.value - self._com.reference.value)
        self.heights.append(float(self._com.point.value[2]))
        forces = np.array(list(self._simulation.contacts().values()))
        self.grips.append(float(np.max(np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2])))
        self.torques.append(self._simulation.torque.copy())

    def check(self, friction, way):
        """Check that the centre of mass has followed to within 5 mm RMS, and contacts and torques their limits."""
        assert np.sqrt(np.mean(np.sum(np.square(self.errors), axis=1))) < 0.005
        assert max(self.heights) - min(self.heights) > 0.95 * way
        assert max(self.grips) < friction
        assert (np.abs(self.torques) <= self._simulation.kinematics.effort_limit).all()


def test_centauro_squats_within_friction_and_torques():
    with contextlib.closing(World()) as world:
        world.run(1.0)
        plugin, before = world.plugin("squat"), world.simulation.torque.copy()
        world.run(0.01)
        watch = Watch(world.bus, plugin, world.simulation)
        world.run(5.0)
        watch.check(GRIP, 0.1)
        assert set(world.simulation.contacts()) == set(WHEELS)
        assert plugin.life is PluginState.RUNNING and not plugin.component.is_holding
        # it takes over what springs carried; what friction in the motors held is 6 Nm, as with `soft_compensation`
        assert np.abs(np.diff([before, *watch.torques[:20]], axis=0))[:, 6:].max() < 8.0


@pytest.mark.slow
@pytest.mark.parametrize(("name", "amplitude"), [("talos", 0.05), ("solo", 0.02), ("anymal", 0.05)])
def test_other_robots_squat_by_their_files_alone(name, amplitude, tmp_path):
    with opened(name, tmp_path, amplitude) as robot:
        robot.run(0.5)
        watch = Watch(robot.bus, robot.plugin, robot.simulation)
        robot.run(4.5)
        watch.check(FRICTION, 2.0 * amplitude)
        assert robot.plugin.life is PluginState.RUNNING and not robot.plugin.component.is_holding
        assert len(robot.simulation.contacts()) == len(LEGGED[name].feet)
