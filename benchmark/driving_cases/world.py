"""A robot that `wheeled_motion` drives in PyBullet, in memory, and what it really does."""

import re
import time
from pathlib import Path

import numpy as np
from driving_cases.driven import CONFIG, Driven, driven, lowest_points

from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware, read_faults
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle

STEP, PERIOD, SETTLE = 0.001, 0.005, 1.5  # [s]
NAME = "wheeled_motion"

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
    """A robot on a plane or in a world, and the plugin that drives it.

    Args:
        folder: Where the configuration is written.
        tags: Tags of the component that differ from the shipped ones, as YAML: `base: center_of_mass, rest: false`.
        is_whole: Whether the plugin's Robot is the whole robot, or its lower body.
        is_estimated: Whether it works with an estimated base and sensors that err as in the bundle; they are perfect
            otherwise.
        world: File of the world; None: a plane.
        urdf: The robot that is simulated; None: as the plugin knows it.
        friction: Friction coefficient of the wheels on the ground; None: as of the bundle.
        robot: File of the robot; None: CENTAURO.
        delay: Time from a measurement of the joints to its message [s]; None: as of the sensors.
        transport: File of the faults of the transport; None: it has none.

    Attributes:
        driven: The robot's files and wheels.
        is_estimated: As given.
        bus: The bus.
        simulation: The robot.
        plugin: What drives it.
        component: Its component.
        costs: Time of each of its cycles [s].

    Raises:
        UnknownName: The faults are of a topic that nobody publishes or receives. SolferErrors: Of several.
    """

    registered, more = NAME, ""
    """Name of the plugin that drives it, and what its configuration has besides."""

    def __init__(  # noqa: PLR0913, PLR0917 a case names what it changes
        self,
        folder: Path,
        tags: str = "",
        is_whole: bool = True,
        is_estimated: bool = False,
        world: str | None = None,
        urdf: str | None = None,
        friction: float | None = None,
        robot: Path | None = None,
        delay: float | None = None,
        transport: Path | None = None,
    ):
        self.driven, self.is_estimated = driven(robot), is_estimated
        self.bus = Bus(parameters_of(self.driven), None if transport is None else read_faults(transport))
        bundle = read_bundle(self.driven.bundle)
        if not is_estimated:
            bundle = bundle.with_perfect_sensors()
        if delay is not None:
            bundle = bundle.model_copy(update={"sensors": bundle.sensors.model_copy(update={"delay": delay})})
        self.simulation = Simulation.from_file(bundle, description_text=urdf, world=world)
        if friction is not None:
            self.simulation.set_friction("wheels", friction)
        self._server = SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator"))
        self.bus.every(STEP, self._server.cycle)
        base = ESTIMATED_BASE if is_estimated else TRUE_BASE
        file = configuration_of(folder, self.driven, tags, is_whole, base=base, more=self.more)
        self.costs: list[float] = []
        self.run(SETTLE)
        if is_estimated:
            self.bus.every(PERIOD, self._plugin(file, "odometry3").cycle, cycles=True)
            self.run(SETTLE)
        self.plugin = self._plugin(file, NAME)
        self.component: WheeledMotion = self.plugin.component
        self.bus.check_faults()

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
        found = Registry().find(self.registered if name == NAME else name)
        return generate(made, MemoryMiddleware(self.bus, name), found)

    @property
    def fallen(self) -> str:
        """Why the robot does not stand on its wheels any more; empty: it does."""
        now = self.simulation.state.now
        if now.rotation(self.driven.base)[2, 2] < np.cos(0.5):
            return "tilted"
        others = set(self.simulation.contact_links()) - set(self.driven.links)
        return f"lies on {', '.join(sorted(others))}" if others else ""

    def touching(self) -> np.ndarray:
        """Return which wheels touch the ground, shape (4,)."""
        links = self.simulation.contact_links()
        return np.array([wheel in links for wheel in self.driven.links])

    def vertices(self) -> np.ndarray:
        """Return the lowest points of the wheels in the world, shape (4, 3) [m]."""
        return lowest_points(self.simulation.state.now, self.driven.wheels)

    def sliding(self) -> np.ndarray:
        """Return the speed of each wheel's material over the ground, and of its centre, shape (4, 2) [m/s]."""
        speeds = []
        for wheel in self.driven.wheels:
            velocity = self.simulation.state.now.velocity(wheel.link)
            linear, (wx, wy, _) = velocity[:3], velocity[3:]
            # the simulated wheel is a ball
            material = linear[:2] + (wheel.ring + wheel.tube) * np.array((-wy, wx))
            speeds.append((np.linalg.norm(material), np.linalg.norm(linear[:2])))
        return np.array(speeds)


def parameters_of(robot: Driven) -> dict[str, str]:
    """Return the parameters of a robot, with the parts of CENTAURO."""
    found = {"/robot_description": robot.urdf, "/robot_semantic_description": robot.srdf}
    if robot.is_centauro:
        description = Description.from_text(robot.urdf)
        found |= {f"/robot_{part}_body": cut(description, "torso_2", part) for part in ("lower", "upper")}
    return found


def configuration_of(folder: Path, robot: Driven, tags: str, is_whole: bool, *, base: str, more: str = "") -> Path:
    """Write the robot's configuration with what differs."""
    text, path, secondary = robot.configuration.read_text(), folder / "main.yaml", folder / "secondary.yaml"
    if not robot.is_centauro:
        feedbacks = f"  feedbacks: {{online: [link_side_online, {base}]}}\n"
        secondary.write_text(f"mwoibn:\n{feedbacks}  modules: {{{NAME}: {{{tags}}}}}\n{more}")
        text = re.sub(r"file: (?=\w)", f"file: {robot.configuration.parent}/", text)
        name = rf"\n    {NAME}:.*\n"
        path.write_text(re.sub(name, rf"\g<0>      secondary_file: {{file: {secondary}}}\n", text, count=1))
        return path
    parts = WHOLE_BODY if is_whole else LOWER_BODY
    secondary.write_text(SECONDARY.format(parts=parts, base=base, name=NAME, tags=tags) + more)
    head, tail = text.split(f"    {NAME}:", 1)
    tail = tail.replace("{file: support/lower_body.yaml}", f"{{file: {secondary}}}", 1)
    path.write_text(re.sub(r"file: (support|robots)/", rf"file: {CONFIG}/\1/", f"{head}    {NAME}:{tail}"))
    return path
