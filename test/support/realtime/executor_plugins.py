"""What several tests of executor plugins share."""

from support.integration.world import CONFIG

from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules, ExecutorTelemetry

RULES = ExecutorRules(blend=0.5)


class Layer:
    """An executor with plugins on the bus of a world.

    Attributes:
        world: The world.
        executor: The executor, with its cycles on the bus.
        work: Time of each cycle of a component, by name of the plugin [s]; the virtual clock moves by it.

    What else is given is passed to `load`.
    """

    def __init__(self, world, folder, plugins, rules=RULES, **loaded):
        self.world, bus = world, world.bus
        self._extra, self._polls, self._loaded = 0, [], loaded
        made = [self._made(*plugin) for plugin in plugins]
        folder.mkdir(exist_ok=True)
        self.executor = Executor(
            made,
            self.node("xbot"),
            EmergencyStopLatch(folder),
            rules=rules,
            polls=self._polls,
            telemetry=ExecutorTelemetry(nanoseconds=lambda: round(1e9 * bus.time) + self._extra),
        )
        self.begin()

    def begin(self):
        """Schedule the cycles on the bus."""
        self.world.bus.every(1.0 / self.executor.rate, self.executor.cycle)

    def node(self, name):
        """Make a node of the world; in shared memory its `poll` is scheduled, too."""
        if not hasattr(self.world, "node"):
            return MemoryMiddleware(self.world.bus, name)
        node = self.world.node(name)
        self._polls.append(node.poll)
        return node

    def _made(self, name, file=CONFIG / "centauro.yaml", target=None):
        settings = load(file, name, **self._loaded)
        generator = Registry().find(name, target or settings.module.class_)
        plugin = generate(settings, self.node(name), generator)
        if hasattr(self.world, "offers"):
            self.world.offers(plugin)
        return plugin

    def spend(self, duration):
        """Let time pass in the midst of a cycle [s]."""
        self._extra += round(1e9 * duration)

    def __getitem__(self, name):
        return next(managed for managed in self.executor.plugins if managed.name == name)

    def start(self, name="joint_states", duration=1.0):
        """Start a plugin, and wait until it runs."""
        assert self.world.ask(f"xbotcore/{name}_switch", data=True).success
        self.world.run(duration)
        assert self[name].state is PluginState.RUNNING
