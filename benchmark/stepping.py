#!/usr/bin/env python3
"""How well CENTAURO steps onto a block and down again, with the shipped module `stepping`.

Run with `./run exec python benchmark/stepping.py [--json] [--seed N] [--trials N] [--height H] [--perfect] [--abort]
[--engine NAME]`. Each row is a trial with shipped sensors, on the base of odometry. Its seed draws the wheel, the
length of the step and the clearance; a front wheel is rolled 20 cm nearer before. The wheel steps up onto a block and
down again behind it. `up` and `down` say whether the answer was success; `margin` is the least distance of the centre
of mass from an edge of the support polygon while it steps [mm], `tilt` the largest tilt of the pelvis [mrad], `rolled`
how far other wheels move [mm], `share` the least share of the mean force that a wheel carries at the end, and `error`
that of the estimated place [mm]. With `--abort` the step is given up at a drawn moment; `up` is then whether all wheels
stand where they stood. The exit code is 1 where a trial fails: no success, a margin below 20 mm, a wheel that carries
less than 0.3 of the mean, or a pelvis that tilts by 0.1 rad.
"""

import math
import sys
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from form import Figures, add_engine, parser_of

from solfer.middleware.memory import MemoryMiddleware
from solfer.simulation import Simulation, SimulationServer
from solfer.transport.messages import FieldsMessage

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test"))

from support.integration.world import ROBOT, World, perfect  # noqa: E402

LEGS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")
NEARER, GAP = 0.2, 0.12
"""How far a front wheel is rolled to the base, and how far a wheel stands from the edge of the block [m]."""

LONGEST = 60.0
"""Longest time until an answer [s]."""


@dataclass(frozen=True)
class Draw:
    """What a seed draws: wheel, length of the step [m], clearance [m], and when it is given up [s]."""

    wheel: int
    ahead: float
    clearance: float
    abort: float

    @classmethod
    def of(cls, seed: int) -> "Draw":
        """Draw by a seed."""
        random = np.random.default_rng(seed)
        wheel = int(random.integers(4))
        low, high = (0.02, 0.03) if wheel < 2 else (0.01, 0.015)
        return cls(wheel, random.uniform(0.2, 0.23), random.uniform(low, high), random.uniform(0.5, 12.0))


class BlockWorld(World):
    """CENTAURO with a block where a wheel is to step, and the plugins that step.

    Args:
        folder: Folder of the file of the world.
        draw: What the seed has drawn.
        height: Height of the block [m].
        is_perfect: Whether sensors are perfect.
    """

    def __init__(self, folder: Path, draw: Draw, height: float, is_perfect: bool):
        side = 0.318 if draw.wheel % 2 == 0 else -0.318
        edge = 1.0 if draw.wheel < 2 else -0.546 + GAP
        self._file = folder / "block.yaml"
        box = f"{{size: [0.6, 0.5, {height}], position: [{edge + 0.3}, {side}, {0.5 * height}]}}"
        self._file.write_text(f"boxes: {{block: {box}}}")
        self._draw = draw
        self._edge = edge
        self.is_perfect = is_perfect
        super().__init__()
        self.run(0.5)
        for name, kind in (("odometry", "Odometry"), ("ground_forces", "GroundForces")):
            self.plugin(name, target=f"solfer.components.{name}:{kind}")
            self.run(0.5)
        self.component = self.plugin("stepping", target="solfer.components.wheeled_motion:WheeledMotion").component
        self.run(0.5)

    def offer(self, middleware: MemoryMiddleware) -> tuple[Simulation, SimulationServer]:  # noqa: D102 see World
        simulation = Simulation.from_file(perfect() if self.is_perfect else ROBOT / "robot.yaml", world=self._file)
        return simulation, SimulationServer(simulation, middleware)

    @property
    def wheels(self) -> np.ndarray:
        """Places of the wheels, shape (4, 3) [m]."""
        return np.array([self.simulation.state.now.position(f"wheel_{number}") for number in (1, 2, 3, 4)])

    def approach(self) -> None:
        """Roll a front wheel nearer to the base, and drive to the block."""
        wheel = self._draw.wheel
        if wheel > 1:
            return
        places = self.component.references.vertices.copy()
        places[wheel, 0] -= NEARER
        sender = MemoryMiddleware(self.bus, "sender")
        support = sender.writer("stepping/wheels_support", "solfer/WheelsSupport")
        for _ in range(60):
            support.write(FieldsMessage({"position": places.ravel().tolist(), "velocity": []}))
            self.run(0.1)
        velocity = sender.writer("stepping/cmd_vel", "geometry_msgs/Twist")
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        left = math.inf
        while left > 0.0:
            left = self._edge - GAP - self.wheels[wheel, 0]
            speed = max(0.0, min(0.15, left))
            velocity.write(FieldsMessage({"linear": zero | {"x": speed + 0.01}, "angular": zero}))
            self.run(0.05)
        self.run(2.0)

    def step(self, ahead: float, up: float, abort: float = math.inf) -> dict[str, float | str]:
        """Step, and return the figures; give it up after a time [s]."""
        draw = self._draw
        before = self.wheels
        tilts, margins = [], []
        request = {"contact": LEGS[draw.wheel], "ahead": ahead, "left": 0.0, "up": up, "clearance": draw.clearance}
        reply = self.bus.call("stepping/step", **request)
        begin = self.bus.time
        while not reply.done() and self.bus.time < begin + LONGEST:
            self.run(0.05)
            if self.bus.time > begin + abort:
                abort = math.inf
                self.bus.call("stepping/lift", contacts=[LEGS[draw.wheel]], lifted=False)
            tilts.append(math.acos(min(1.0, self.simulation.state.now.rotation("pelvis")[2, 2])))
            margins.append(self.component._guard.margin)
        self.run(2.0)
        moved = np.linalg.norm((self.wheels - before)[:, :2], axis=1)
        forces = self.component.wheels.measure_forces()
        error = self.component.model.state.position[:2] - self.simulation.state.now.position("pelvis")[:2]
        return {
            "success": float(reply.done() and reply.result().success),
            "stays": float(moved[draw.wheel] < 0.03),
            "margin": 1e3 * min(margins),
            "tilt": 1e3 * max(tilts),
            "rolled": 1e3 * float(np.delete(moved, draw.wheel).max()),
            "share": float(forces.min() / forces.mean()),
            "error": 1e3 * float(np.linalg.norm(error)),
        }


def measure(seed: int, height: float, is_perfect: bool, is_aborted: bool) -> tuple[str, dict[str, float | None], bool]:
    """Run a trial; return its title, its figures, and whether it is good."""
    draw = Draw.of(seed)
    with tempfile.TemporaryDirectory() as folder, closing(BlockWorld(Path(folder), draw, height, is_perfect)) as world:
        world.approach()
        first = world.step(draw.ahead, height, draw.abort if is_aborted else math.inf)
        steps = [first] if is_aborted and first["stays"] else [first, world.step(-draw.ahead, -height)]
    is_down = steps[-1]["success"] if len(steps) > 1 else None
    figures = {
        "up": max(first["success"], first["stays"] if is_aborted else 0.0),
        "down": is_down,
        "margin": min(each["margin"] for each in steps),
        "tilt": max(each["tilt"] for each in steps),
        "rolled": max(each["rolled"] for each in steps),
        "share": min(each["share"] for each in steps),
        "error": max(each["error"] for each in steps),
    }
    is_good = figures["up"] and is_down != 0.0 and figures["margin"] > 20.0 and figures["share"] > 0.3
    title = f"{seed}: {LEGS[draw.wheel]}, {draw.ahead:.3f} m, clearance {draw.clearance:.3f} m"
    return title, figures, bool(is_good and figures["tilt"] < 100.0)


def main() -> int:
    """Print all figures."""
    parser = parser_of(__doc__)
    parser.add_argument("--seed", type=int, default=9001, help="first seed (default: %(default)s)")
    parser.add_argument("--trials", type=int, default=8, help="(default: %(default)s)")
    parser.add_argument("--height", type=float, default=0.1, help="of the block [m] (default: %(default)s)")
    parser.add_argument("--perfect", action="store_true", help="perfect sensors")
    parser.add_argument("--abort", action="store_true", help="steps are given up at drawn moments")
    add_engine(parser)
    arguments = parser.parse_args()
    figures = Figures(arguments.json)
    failed = 0
    for seed in range(arguments.seed, arguments.seed + arguments.trials):
        title, row, is_good = measure(seed, arguments.height, arguments.perfect, arguments.abort)
        figures.row(title, **row)
        failed += not is_good
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
