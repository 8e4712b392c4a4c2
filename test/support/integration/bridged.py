"""CENTAURO and an RT layer in shared memory, plugins outside of it on a bus, and the bridge between them."""

from collections.abc import Iterable
from pathlib import Path

from support.integration.world import CONFIG, World
from support.integration.xbot_world import XbotWorld
from support.shared_memory.xbot_bridge import made

from solfer.config import Configuration
from solfer.middleware.bridge import Bridge, routes
from solfer.middleware.memory import FaultsRecord, MemoryMiddleware
from solfer.plugins import Plugin

BRIDGE = "xbot_bridge"


class BridgedWorld(XbotWorld):
    """As `XbotWorld`; requests by `ask` go over the bridge.

    Args:
        folder: Where the namespace is.
        inside: Configurations of the layer's plugins; their pipes define what crosses the border.

    Attributes:
        bridge: The bridge.
    """

    def __init__(self, folder: Path, inside: Iterable[Configuration], faults: FaultsRecord | None = None):
        super().__init__(folder, faults)
        end = self.node(BRIDGE)
        inwards, outwards = routes(inside)
        self.bridge = made(end.namespace, end, MemoryMiddleware(self.bus, BRIDGE), inwards, outwards)
        self.bus.every(Bridge.PERIOD, self.bridge.cycle)

    def outside(self, name: str, file: Path = CONFIG / "centauro.yaml") -> Plugin:
        """Make a plugin that is not in the layer, and put its cycle on the bus."""
        return World.plugin(self, name, file)
