"""CENTAURO and an RT layer in shared memory, plugins outside of it on a bus, and the bridge between them."""

from pathlib import Path

from test_xbot_bridge import made
from world import World
from xbot_world import XbotWorld

from solfer.config import load
from solfer.middleware.bridge import routes
from solfer.middleware.bridge.bridge import PERIOD
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Plugin

BRIDGE = "xbot_bridge"


class BridgedWorld(XbotWorld):
    """As `XbotWorld`; what is asked by `ask` goes over the bridge.

    Args:
        folder: Where the namespace is.
        file: Main configuration.
        inside: The plugins of the layer, whose pipes say what crosses the border.

    Attributes:
        bridge: The bridge.
    """

    def __init__(self, folder: Path, file: Path, inside: tuple[str, ...]):
        super().__init__(folder)
        end = self.node(BRIDGE)
        inwards, outwards = routes(load(file, name, middleware="XBOT", layer="RT") for name in inside)
        self.bridge = made(end.namespace, end, MemoryMiddleware(self.bus, BRIDGE), inwards, outwards)
        self.bus.every(PERIOD, self.bridge.cycle)

    def outside(self, name: str, file: Path) -> Plugin:
        """Make a plugin that is not in the layer, and put its cycle on the bus."""
        return World.plugin(self, name, file)
