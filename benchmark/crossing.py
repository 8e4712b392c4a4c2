#!/usr/bin/env python3
"""How well CENTAURO crosses steps that a map has: navigation `cross` with the shipped module `stepping`.

Run with `./run exec python benchmark/crossing.py [--json] [--seed N] [--trials N] [--height H] [--down] [--perfect]
[--engine NAME]`. Each row is a trial with shipped sensors, on the base of odometry, 3 m ahead. Its seed draws where a
platform begins and which side of it is nearer, its height, and the masses of the links (10 %). With `--down` it is a
block of 1 m, from which the robot steps down again. `done` is 1 where it arrives; `steps` says how many steps were
made, `margin` is the least distance of the centre of mass from an edge of the support polygon [mm], `tilt` the largest
tilt of the pelvis [mrad], `error` and `turn` how far base and heading are from where they were to go [mm, mrad], by the
truth, and `time` how long it takes [s]. The exit code is 1 where a trial fails: it does not arrive, a margin below
20 mm, or a tilt of 0.1 rad.
"""

import math
import sys
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from form import Figures, add_engine, parser_of

from solfer.errors import ComponentError
from solfer.middleware.memory import MemoryMiddleware
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.bundle import load_bundle
from solfer.simulation.world.world import read_world
from solfer_tools.navigation import CrossingCourse, Navigation, Terrain, Waypoint

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test"))

from support.integration.carried import with_other_masses  # noqa: E402
from support.integration.world import ROBOT, World, perfect  # noqa: E402

AHEAD = 3.0
"""How far the robot goes [m]."""

RATE = 50.0
LONGEST = 300.0


@dataclass(frozen=True)
class Draw:
    """What a seed draws: where the edge is [m], its direction [rad], its height [m]; masses are drawn by the seed."""

    edge: float
    direction: float
    height: float
    seed: int

    @classmethod
    def of(cls, seed: int, height: float | None) -> "Draw":
        """Draw by a seed; a given height [m] is not drawn."""
        random = np.random.default_rng(seed)
        edge, direction, drawn = random.uniform((1.0, -0.1, 0.05), (1.4, 0.1, 0.1))
        return cls(edge, direction, drawn if height is None else height, seed)


class StepWorld(World):
    """CENTAURO before a platform, and the plugins that step.

    Args:
        folder: Folder of the file of the world.
        draw: What the seed has drawn.
        length: Length of the platform [m].
        is_perfect: Whether sensors and masses are perfect.
    """

    def __init__(self, folder: Path, draw: Draw, length: float, is_perfect: bool):
        self.file = folder / "world.yaml"
        x, y = (draw.edge + 0.5 * length) * math.cos(draw.direction), 0.5 * length * math.sin(draw.direction)
        self.file.write_text(
            f"boxes: {{platform: {{size: [{length}, 4, {draw.height}], position: [{x}, {y}, {0.5 * draw.height}], "
            f"rpy: [0, 0, {draw.direction}]}}}}"
        )
        self._draw = draw
        self.is_perfect = is_perfect
        super().__init__()
        self.run(0.5)
        for name, kind in (("odometry", "Odometry"), ("ground_forces", "GroundForces")):
            self.plugin(name, target=f"solfer.components.{name}:{kind}")
            self.run(0.5)
        self.component = self.plugin("stepping", target="solfer.components.wheeled_motion:WheeledMotion").component
        self.run(0.5)

    def offer(self, middleware: MemoryMiddleware) -> tuple[Simulation, SimulationServer]:  # noqa: D102 see World
        urdf = (ROBOT / "centauro.urdf").read_text()
        bundle = perfect()
        if not self.is_perfect:
            bundle = read_bundle(ROBOT / "robot.yaml")
            urdf = with_other_masses(urdf, 0.1, self._draw.seed)
        simulation = Simulation(load_bundle(bundle, urdf), world=read_world(self.file))
        return simulation, SimulationServer(simulation, middleware)

    def tilt(self) -> float:
        """Return the tilt of the pelvis [rad]."""
        return math.acos(min(1.0, self.simulation.state.now.rotation("pelvis")[2, 2]))


def measure(seed: int, given: float | None, length: float, is_perfect: bool) -> tuple[str, dict[str, float], str]:
    """Run a trial; return its title, its figures, and why it failed."""
    draw = Draw.of(seed, given)
    failure = ""
    with tempfile.TemporaryDirectory() as folder, closing(StepWorld(Path(folder), draw, length, is_perfect)) as world:
        node = MemoryMiddleware(world.bus, "navigation")
        course = CrossingCourse(
            node,
            Waypoint(AHEAD, 0.0),
            Terrain(read_world(world.file)),
            "stepping",
            odometry="odometry/odom",
            ground="odometry/ground",
        )
        navigation = Navigation(node, course, "navigation", RATE)
        begin = world.bus.time
        margin, tilt = math.inf, 0.0
        try:
            while not navigation.done and world.bus.time < begin + LONGEST:
                navigation.cycle()
                world.run(1.0 / RATE)
                margin = min(margin, world.component._guard.margin)
                tilt = max(tilt, world.tilt())
        except ComponentError as error:
            failure = str(error).partition("\n")[0]
        now = world.simulation.state.now
        place, rotation = now.position("pelvis"), now.rotation("pelvis")
        heading = math.atan2(rotation[1, 0], rotation[0, 0])
        figures = {
            "done": float(navigation.done),
            "steps": float(course.steps),
            "margin": 1e3 * margin,
            "tilt": 1e3 * tilt,
            "error": 1e3 * float(np.hypot(place[0] - AHEAD, place[1])),
            "turn": 1e3 * abs(math.remainder(heading - course.heading, math.tau)),
            "time": world.bus.time - begin,
        }
    if not navigation.done:
        failure = failure or f"not there after {LONGEST:g} s"
    elif figures["margin"] < 20.0 or figures["tilt"] > 100.0:
        failure = "a margin below 20 mm, or a tilt above 0.1 rad"
    title = f"{seed}: edge at {draw.edge:.2f} m, {math.degrees(draw.direction):+.0f} deg, {1e3 * draw.height:.0f} mm"
    return title, figures, failure


def main() -> int:
    """Print all figures."""
    parser = parser_of(__doc__)
    parser.add_argument("--seed", type=int, default=9001, help="first seed (default: %(default)s)")
    parser.add_argument("--trials", type=int, default=5, help="(default: %(default)s)")
    parser.add_argument("--height", type=float, help="of the platform [m] (default: drawn, 0.05 to 0.1)")
    parser.add_argument("--down", action="store_true", help="step down again")
    parser.add_argument("--perfect", action="store_true", help="perfect sensors and masses")
    add_engine(parser)
    arguments = parser.parse_args()
    figures = Figures(arguments.json)
    failures = 0
    for seed in range(arguments.seed, arguments.seed + arguments.trials):
        title, row, failure = measure(seed, arguments.height, 1.0 if arguments.down else 4.0, arguments.perfect)
        figures.row(title, **row)
        if failure:
            failures += 1
            print(f"{seed}: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
