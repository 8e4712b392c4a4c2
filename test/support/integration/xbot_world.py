"""CENTAURO and plugins in one process on a virtual clock, with their pipes in shared memory."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from support.bus_clock import BusClock
from support.integration.world import CONFIG, ROBOT, World, perfect

from solfer.config import load
from solfer.middleware.memory import FaultsRecord
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.plugins import Plugin, Registry, generate, generate_shared
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules, ExecutorTelemetry
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.mock_hardware.mock_hardware import MockHardware
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import SWITCH_ONE, Flag

ON_BOTH = pytest.mark.parametrize("world", ("ROS", pytest.param("XBOT", marks=pytest.mark.soak)), indirect=True)
"""For tests that hold with each `middleware:`; nothing else changes. ROS stands for a `World` in memory.

Each day the one in memory, beside the contract of pipes and `test_both_memories_agree_bitwise`.
"""


class XbotWorld(World):
    """As `World`, with all that crosses a border in shared memory: its plugins are loaded with `middleware: XBOT`.

    Args:
        folder: Where the namespace is.
    """

    def __init__(self, folder: Path, faults: FaultsRecord | None = None):
        self._folder, self._services = folder, {}
        super().__init__(faults)
        self._asker = self.node("world")

    def node(self, name: str) -> XbotMiddleware:
        """Make a node of the namespace."""
        return XbotMiddleware(Namespace("test", self._folder), name, self.bus.parameters, BusClock(self.bus))

    def offer(self, middleware):
        """See `World.offer`."""
        self._node = self.node(middleware.name)
        return self.serve(self._node)

    def serve(self, node: XbotMiddleware) -> tuple[Simulation, SimulationServer | MockHardware]:
        """Make the robot, and what offers it by a node."""
        simulation = Simulation.from_file(perfect() if self.is_perfect else ROBOT / "robot.yaml")
        return simulation, SimulationServer(simulation, node)

    def _step(self) -> None:
        self._node.poll()
        super()._step()
        self._node.poll()

    def plugin(self, name: str, file: Path = CONFIG / "centauro.yaml", target: str | None = None) -> Plugin:
        """See `World.plugin`."""
        configuration, node = load(file, name, middleware="XBOT"), self.node(name)
        plugin = generate(configuration, node, Registry().find(name, target or configuration.module.class_))
        self.bus.every(1.0 / plugin.rate, node.poll)
        self.bus.every(1.0 / plugin.rate, plugin.cycle)
        self.offers(plugin)
        return plugin

    def executor(self, listed: Sequence, rules: ExecutorRules | None = None) -> Executor:
        """Make plugins that share what they can under an executor, with a node each, which are not yet started."""
        nodes = {each.configuration.module.name: self.node(each.configuration.module.name) for each in listed}
        members = generate_shared(listed, lambda each: nodes[each.module.name], Registry())
        for plugin in members.plugins:
            self.offers(plugin)
        return Executor(
            members.plugins,
            self.node("xbot"),
            EmergencyStopLatch(self._folder),
            rules=rules or ExecutorRules(),
            polls=[members.sharing.turns.next, XbotMiddleware.poll_all(nodes.values())],
            requires=members.requires,
            telemetry=ExecutorTelemetry(nanoseconds=lambda: round(1e9 * self.bus.time)),
        )

    def pause(self, paused: bool) -> None:
        """See `World.pause`."""
        self._asker.request("simulator/pause", SWITCH_ONE, Flag(paused), Answer, 1.0)

    def offers(self, plugin: Plugin) -> None:
        """Note the services of a plugin, for `ask`."""
        self._services |= {f"{plugin.name}/{service.name}": service for service in plugin.component.services()}

    def ask(self, service: str = "joint_states/trajectory", **fields):
        """See `World.ask`; services of plugins only."""
        offered = self._services[service]
        reply = self._asker.request(service, offered.interface, offered.request(**fields), offered.reply, 1.0)
        self.run(0.02)
        self._asker.poll()
        return reply.result(0)
