"""A node with several plugins: each of them is a component of it, with a claim of its own."""

import yaml
from support.integration.world import STEP
from support.plugins.plugin import WHEELS, configuration

from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, generate

NODE = "limbs"
CLASS = "solfer.components.joint_states:JointStates"
PARTS = {"springs": ["position_controller"], "drives": ["velocity_controller"], "all_of_it": "direct"}
"""The components, and the pipes of each to the lower level."""


def parts(folder):
    """Write a configuration with all PARTS, which command what `joint_states` commands otherwise."""
    path = configuration(folder, **{"class": CLASS})
    tree = yaml.safe_load(path.read_text())
    modules = tree["mwoibn"]["modules"]
    modules |= {name: modules["test"] | {"controller": controller} for name, controller in PARTS.items()}
    path.write_text(yaml.safe_dump(tree))
    return path


class Node:
    """Plugins in one node of a world, which share its middleware.

    Attributes:
        middleware: The node's.
        plugins: The plugins by name, with their cycles on the bus.
    """

    def __init__(self, world, path, names):
        self.world, self._path, self._shared = world, path, hasattr(world, "node")
        self.middleware = world.node(NODE) if self._shared else MemoryMiddleware(world.bus, NODE)
        self.plugins = {}
        if self._shared:
            world.bus.every(STEP, self.middleware.poll)
        for name in names:
            self.add(name)

    def add(self, name):
        """Make one more plugin in the node."""
        settings = load(self._path, name, middleware="XBOT" if self._shared else "ROS")
        plugin = generate(settings, self.middleware, Registry().find(name, settings.module.class_))
        if self._shared:
            self.world.offers(plugin)
        self.world.bus.every(1.0 / plugin.rate, plugin.cycle)
        self.plugins[name] = plugin
        return plugin

    def owners(self):
        """Return who has claimed the joints of the two controllers."""
        describe = self.world.simulation.lower_level.claims.describe
        return describe("position_controller"), describe("velocity_controller")

    def drive(self, name="drives", speed=2.0):
        """Let a component turn the wheels [rad/s]."""
        assert self.world.ask(f"{name}/trajectory", joints=WHEELS, velocities=(speed,) * len(WHEELS)).success
        self.world.run(1.0)
