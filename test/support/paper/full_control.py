"""CENTAURO under the control of Fig. 5, in one process: as nodes do it, or as a real-time layer and its bridge do."""

import numpy as np
from support.integration.bridged import BridgedWorld
from support.integration.world import CONFIG, World
from support.simulation.hardware_plugin import mocked

from solfer.config import load, load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.middleware.memory import MemoryMiddleware
from solfer.model import Kinematics
from solfer.plugins import Registry, generate
from solfer_tools.demo.waving import FRAME, HANDS, Waving
from solfer_tools.navigation import Navigation, ScenarioCourse
from solfer_tools.scenarios import Player, Scenario

STANCE = "\n".join(f"{axis} cp: [0.0, 0.0, 0.0, 0.0]\n{axis} cp ref: [[0.0, 0.0, 0.0, 0.0]]" for axis in "xyz")

PERIOD = 0.02
"""Of navigation and of what waves [s]."""

WHEELS = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))


def course(ahead: float, turn: float, speed: float, turn_speed: float) -> str:
    """Return a scenario in which the base goes ahead [m] and turns [rad] meanwhile, at speeds [m/s, rad/s]."""
    return f"""
base now: [0.0, 0.0, 0.0, 0.0]
base_const_vel: [0.0, 0.0, 0.0, 0.0]
vel: 0.02
dt: 0.01
{STANCE}
base ref: [[0.0, 0.0, 0.0, 0.0], [{ahead}, 0.0, 0.0, {turn}]]
pattern:
  1: {{type: speed, motions: [[3, 0, {speed}], [3, 3, {turn_speed}]]}}
  2: {{type: move, x_cp: 0, y_cp: 0, z_cp: 0, base: 1}}
  3: {{type: wait, steps: 100}}
"""


class Driven:
    """A world whose plugins are those of Fig. 5.

    Attributes:
        plugins: All of them by name, in the order of their cycles.
    """

    is_perfect = False

    def play(self, scenario: Scenario, look) -> Navigation:
        """Carry out a scenario while the hands wave; `look` is called in each period of the navigation."""
        node = MemoryMiddleware(self.bus, "navigation")
        course = ScenarioCourse(node, Player(scenario, PERIOD), "locomotion", "odometry/odom", positions=True)
        navigation, begin = Navigation(node, course, "navigation", 1.0 / PERIOD), self.bus.time
        waving = Waving(node, "hands", self.hands())
        while not navigation.done:
            navigation.cycle()
            waving.send(self.bus.time - begin)
            self.run(PERIOD)
            look(waving)
        node.close()
        return navigation

    def seen(self, link: str) -> np.ndarray:
        """Return where a link truly is as seen from the pelvis, shape (3,) [m]."""
        now = self.simulation.state.now
        return now.rotation(FRAME).T @ (now.position(link) - now.position(FRAME))

    def hands(self) -> dict[str, np.ndarray]:
        """Return where the hands truly are as seen from the pelvis, by task, each of shape (3,) [m]."""
        return {name: self.seen(link) for name, link in HANDS.items()}

    def footprint(self) -> np.ndarray:
        """Return where the wheels truly are as seen from the pelvis, x and y, shape (4, 2) [m]."""
        return np.array([self.seen(wheel)[:2] for wheel in WHEELS])

    def center_of_legs(self) -> np.ndarray:
        """Return where the centre of mass of the legs' Robot truly is in the world, shape (3,) [m]."""
        legs, dofs = self.plugins["locomotion"].robot, self.simulation.kinematics.dofs
        kinematics = Kinematics(legs.description)
        kinematics.update(self.simulation.q[[dofs.index(name) for name in legs.dofs]])
        return kinematics.center_of_mass.copy()

    def center_of_mass(self) -> np.ndarray:
        """Return where the centre of mass truly is as seen from the pelvis, shape (3,) [m]."""
        self.simulation.kinematics.update(self.simulation.q)
        now = self.simulation.state.now
        return now.rotation(FRAME).T @ (self.simulation.kinematics.center_of_mass - now.position(FRAME))


class Nodes(Driven, World):
    """As nodes under ROS do it: `hands` by itself, and the shared plugin.

    Attributes:
        set: The plugins of the shared one.
    """

    system = "SM"

    def __init__(self, _folder, faults=None):
        super().__init__(faults)
        self.run(0.5)
        registry, file = Registry(), CONFIG / "centauro.yaml"
        alone = load(file, "hands", system=self.system)
        generator = registry.find("inverse_kinematics", alone.module.class_)
        hands = generate(alone, MemoryMiddleware(self.bus, "hands"), generator)
        self.bus.every(1.0 / hands.rate, lambda: hands.cycle(), cycles=True)  # which tests replace
        shared = load_shared(file, "full_control", default=registry.configuration, system=self.system)
        self.set = together = self.together(shared.plugins)
        together.start()
        self.rate = together.rate
        self.bus.every(1.0 / self.rate, lambda: together.cycle(), cycles=True)
        self.plugins = {"hands": hands} | {managed.name: managed.plugin for managed in together.plugins}


class HardwareNodes(Nodes):
    """The same with `system: HW`, on a mock of the hardware."""

    system = "HW"

    def offer(self, middleware):
        """See `World.offer`."""
        return mocked(middleware)


class Figure5Layer(Driven, BridgedWorld):
    """As a layer does it, by default config/figures/figure_5.yaml; navigation and waving are outside of it."""

    def __init__(self, folder, file=CONFIG / "figures" / "figure_5.yaml", faults=None):
        registry = Registry()
        layer = read_layer(file, registry.configuration)
        listed = layer.load()
        super().__init__(folder, [each.configuration for each in listed], faults)
        self.run(0.5)
        self.layer = self.executor(listed)
        self.layer.switchboard.commit(self.layer.switchboard.plan(layer.start))
        self.rate = self.layer.rate
        self.bus.every(1.0 / self.rate, self.layer.cycle, cycles=True)
        self.plugins = {managed.name: managed.plugin for managed in self.layer.plugins}
