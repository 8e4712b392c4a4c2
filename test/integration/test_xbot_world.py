"""The same plugins and the same simulated robot in memory and in shared memory: to the last bit the same motion."""

from pathlib import Path

import numpy as np
import pytest
from world import CONFIG, ROBOT, World

from solfer.config import load
from solfer.middleware.xbot import Namespace, XbotMiddleware
from solfer.middleware.xbot.bus_clock import BusClock
from solfer.plugins import Life, Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer

GOAL = "mammal_wide_high"


class XbotWorld(World):
    """As `World`, with all that crosses a border in shared memory.

    Args:
        folder: Where the namespace is.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        super().__init__()

    def node(self, name: str) -> XbotMiddleware:
        """A node of the namespace."""
        return XbotMiddleware(Namespace("test", self._folder), name, self.bus.parameters, BusClock(self.bus))

    def offer(self, middleware):
        """See `World.offer`."""
        simulation = Simulation.from_file(ROBOT / "robot.yaml")
        self._node = self.node(middleware.name)
        return simulation, SimulationServer(simulation, self._node)

    def _step(self) -> None:
        self._node.poll()
        super()._step()
        self._node.poll()

    def plugin(self, name: str, file: Path = CONFIG / "centauro.yaml", target: str | None = None) -> Plugin:
        """See `World.plugin`."""
        configuration, node = load(file, name), self.node(name)
        plugin = generate(configuration, node, Registry().find(name, target or configuration.module.class_))
        self.bus.every(1.0 / plugin.rate, node.poll)
        self.bus.every(1.0 / plugin.rate, plugin.cycle)
        return plugin


def moved(world: World, ask) -> np.ndarray:
    """Joints and base, sampled while `joint_states` moves CENTAURO."""
    plugin, rows = world.plugin("joint_states"), []
    world.run(0.1)
    assert plugin.life is Life.RUNNING
    assert ask(plugin).success
    for _ in range(40):
        world.run(0.05)
        rows.append(np.concatenate((world.simulation.q, plugin.robot.command.position, plugin.robot.state.velocity)))
    world.close()
    return np.array(rows)


@pytest.fixture
def in_memory():
    world = World()
    return moved(world, lambda _: world.ask(state=GOAL))


def test_memory_and_shared_memory_agree_to_the_last_bit(in_memory, tmp_path):
    world = XbotWorld(tmp_path)

    def ask(plugin):
        [service] = (each for each in plugin.component.services() if each.name == "trajectory")
        asker = world.node("asker")
        answer = asker.request("joint_states/trajectory", service.interface, service.request(state=GOAL),
                               service.reply, 1.0)
        world.run(0.02)
        asker.poll()
        return answer.result(0)

    shared = moved(world, ask)
    assert np.ptp(in_memory, axis=0).max() > 0.3  # it moved
    np.testing.assert_array_equal(shared, in_memory)
