"""CENTAURO and plugins in one process on a virtual clock."""

from collections.abc import Callable, Sequence
from functools import cache, wraps
from pathlib import Path

from solfer.config import load
from solfer.middleware.memory import Bus, FaultsRecord, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Plugin, PluginSet, Registry, generate, generate_shared
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.bullet import robot as bullet_robot
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.mock_hardware.mock_hardware import MockHardware
from solfer.transport import Middleware

CONFIG = Path(__file__).parents[3] / "config"
ROBOT = CONFIG / "robots" / "centauro"
STEP = 0.001  # [s]


@cache
def parameters() -> dict[str, str]:
    """Make the texts that describe CENTAURO and its parts."""
    urdf = (ROBOT / "centauro.urdf").read_text()
    description = Description.from_text(urdf)
    return {
        "/robot_description": urdf,
        "/robot_semantic_description": (ROBOT / "centauro.srdf").read_text(),
        "/robot_lower_body": cut(description, "torso_2", "lower"),
        "/robot_upper_body": cut(description, "torso_2", "upper"),
    }


def once(make: Callable, text: Callable[..., str]) -> Callable:
    """Let a function make what belongs to CENTAURO once: half of a world's beginning is the same parsing."""
    known = cache(make)

    @wraps(make)
    def made(first, *others, **named):
        ours = text(first) in parameters().values()
        return (known if ours else make)(first, *others, **named)

    return made


def perfect() -> BundleRecord:
    """Read CENTAURO with perfect sensors, for tests whose subject is not their errors."""
    return read_bundle(ROBOT / "robot.yaml").with_perfect_sensors()


parameters()
Description.from_text = once(Description.from_text, str)
bullet_robot.body_urdf = once(bullet_robot.body_urdf, lambda description: description.text)


class World:
    """A simulated CENTAURO with its lower level on a bus.

    Args:
        faults: What happens to messages and cycles on the way; None: nothing.

    Attributes:
        bus: The bus; `run` lets time pass.
        simulation: The robot.
        received: Whether the robot publishes.
        asleep: Names of plugins that stand still.
    """

    is_perfect = True
    """Whether its sensors are perfect, or as they are shipped."""

    def __init__(self, faults: FaultsRecord | None = None):
        self.bus = Bus(dict(parameters()), faults=faults)
        self.simulation, self._server = self.offer(MemoryMiddleware(self.bus, "simulator"))
        self.received, self.asleep = True, set()
        self.bus.every(STEP, self._step)

    def offer(self, middleware: Middleware) -> tuple[Simulation, SimulationServer | MockHardware]:
        """Make the robot, and what offers it on the bus."""
        simulation = Simulation.from_file(perfect() if self.is_perfect else ROBOT / "robot.yaml")
        return simulation, SimulationServer(simulation, middleware)

    def _step(self) -> None:
        if self.received:
            self._server.cycle()
        else:
            self.simulation.step()

    def run(self, duration: float) -> None:
        """Let `duration` [s] pass."""
        self.bus.run_until(self.bus.time + duration)

    def plugin(self, name: str, file: Path = CONFIG / "centauro.yaml", target: str | None = None) -> Plugin:
        """Make a plugin and schedule its cycle on the bus, not yet started."""
        configuration = load(file, name)
        known = name if name in Registry() else "joint_states"
        generator = Registry().find(known, target or configuration.module.class_)
        plugin = generate(configuration, self.connect(name), generator)
        self.bus.every(1.0 / plugin.rate, lambda: name in self.asleep or plugin.cycle(), cycles=True)
        return plugin

    def connect(self, name: str) -> Middleware:
        """Make the middleware of a node."""
        return MemoryMiddleware(self.bus, name)

    def together(self, listed: Sequence) -> PluginSet:
        """Make plugins that share what they can in one loop, with a node each, not yet started."""
        members = generate_shared(listed, lambda each: MemoryMiddleware(self.bus, each.module.name), Registry())
        return PluginSet(members.plugins, polls=[members.sharing.turns.next], requires=members.requires)

    def pause(self, paused: bool) -> None:
        """Let the simulation stand still, or go on."""
        self.bus.call("simulator/pause", data=paused)

    def ask(self, service: str = "joint_states/trajectory", **fields):
        """Call a service and let its owner answer."""
        reply = self.bus.call(service, **fields)
        self.run(0.02)
        return reply.result(0)

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()
