"""CENTAURO that `wheeled_motion` drives in PyBullet, in memory, and what it really does."""

import re
import time
from pathlib import Path

import numpy as np

from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer

CONFIG = Path(__file__).resolve().parents[2] / "config"
ROBOT = CONFIG / "robots" / "centauro"
STEP, PERIOD, SETTLE = 0.001, 0.005, 1.5  # [s]
RING, TUBE = 0.01, 0.068  # of a wheel [m]
NAME = "wheeled_motion"
WHEELS = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))

TRUE_BASE, ESTIMATED_BASE = "floating_base", "odometry"

SECONDARY = """mwoibn:
{parts}  feedbacks:
    online: [link_side_online, {base}]
  modules:
    {name}: {{{tags}}}
"""

LOWER_BODY = """  ros: &part {source: {urdf: /robot_lower_body}}
  xbot: *part
"""

WHOLE_BODY = """  controller:
    position_controller: {dofs: {chain: position_lower_body}}
"""


class World:
    """CENTAURO on a plane or in a world, and the plugin that drives it.

    Args:
        folder: Where the configuration is written.
        tags: Tags of the component that differ from the shipped ones, as YAML: `base: center_of_mass, rest: false`.
        is_whole: Whether the plugin's Robot is the whole robot, or its lower body.
        is_estimated: Whether it works with an estimated base.
        world: File of the world; None: a plane.
        urdf: The robot that is simulated; None: as the plugin knows it.
        friction: Friction coefficient of the wheels on the ground; None: as of the bundle.

    Attributes:
        bus: The bus.
        simulation: The robot.
        plugin: What drives it.
        component: Its component.
        lift: Its service that lifts wheels and puts them down.
        costs: Time of each of its cycles [s].
    """

    def __init__(
        self,
        folder: Path,
        tags: str = "",
        is_whole: bool = True,
        is_estimated: bool = False,
        world: str | None = None,
        urdf: str | None = None,
        friction: float | None = None,
    ):
        text = (ROBOT / "centauro.urdf").read_text()
        description = Description.from_text(text)
        parts = {f"/robot_{part}_body": cut(description, "torso_2", part) for part in ("lower", "upper")}
        srdf = (ROBOT / "centauro.srdf").read_text()
        self.bus = Bus({"/robot_description": text, "/robot_semantic_description": srdf, **parts})
        self.simulation = Simulation.from_file(ROBOT / "robot.yaml", description_text=urdf, world=world)
        if friction is not None:
            self.simulation.set_friction("wheels", friction)
        self._server = SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator"))
        self.bus.every(STEP, self._server.cycle)
        file = _configuration(folder, tags, is_whole, ESTIMATED_BASE if is_estimated else TRUE_BASE)
        self.costs: list[float] = []
        self.run(SETTLE)
        if is_estimated:
            self.bus.every(PERIOD, self._plugin(file, "odometry3").cycle)
            self.run(SETTLE)
        self.plugin = self._plugin(file, NAME)
        self.component: WheeledMotion = self.plugin.component
        (lift,) = self.component.services()
        self.lift = lift.handler

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()

    def run(self, duration: float) -> None:
        """Let a time pass [s]."""
        self.bus.run_until(self.bus.time + duration)

    def cycle(self) -> None:
        """Run one cycle of the plugin."""
        begun = time.thread_time()  # the machine may be busy with others
        self.plugin.cycle()
        self.costs.append(time.thread_time() - begun)

    def _plugin(self, file: Path, name: str) -> Plugin:
        made = load(file, "odometry" if name == "odometry3" else name)
        return generate(made, MemoryMiddleware(self.bus, name), Registry().find(name))

    @property
    def fallen(self) -> str:
        """Why the robot does not stand on its wheels any more; empty: it does."""
        now = self.simulation.state.now
        if now.rotation("pelvis")[2, 2] < np.cos(0.5):
            return "tilted"
        others = set(self.simulation.contact_links()) - set(WHEELS)
        return f"lies on {', '.join(sorted(others))}" if others else ""

    def touching(self) -> np.ndarray:
        """Return which wheels touch the ground, shape (4,)."""
        links = self.simulation.contact_links()
        return np.array([wheel in links for wheel in WHEELS])

    def vertices(self) -> np.ndarray:
        """Return the lowest points of the wheels in the world, shape (4, 3) [m]."""
        now, found = self.simulation.state.now, []
        for wheel in WHEELS:
            axle = now.rotation(wheel)[:, 2]
            down = np.array((0.0, 0.0, 1.0)) - axle * axle[2]
            found.append(now.position(wheel) - RING * down / np.linalg.norm(down) - (0.0, 0.0, TUBE))
        return np.array(found)

    def sliding(self) -> np.ndarray:
        """Return the speed of each wheel's material over the ground, and of its centre, shape (4, 2) [m/s]."""
        speeds = []
        for wheel in WHEELS:
            velocity = self.simulation.state.now.velocity(wheel)
            linear, (wx, wy, _) = velocity[:3], velocity[3:]
            # the simulated wheel is a ball
            material = linear[:2] + (RING + TUBE) * np.array((-wy, wx))
            speeds.append((np.linalg.norm(material), np.linalg.norm(linear[:2])))
        return np.array(speeds)


def _configuration(folder: Path, tags: str, is_whole: bool, base: str) -> Path:
    """Write the shipped configuration with what differs."""
    text = (CONFIG / "centauro.yaml").read_text()
    secondary = folder / "secondary.yaml"
    secondary.write_text(
        SECONDARY.format(parts=WHOLE_BODY if is_whole else LOWER_BODY, base=base, name=NAME, tags=tags)
    )
    head, tail = text.split(f"    {NAME}:", 1)
    tail = tail.replace("{file: support/lower_body.yaml}", f"{{file: {secondary}}}", 1)
    path = folder / "main.yaml"
    path.write_text(re.sub(r"file: (support|robots)/", rf"file: {CONFIG}/\1/", f"{head}    {NAME}:{tail}"))
    return path
