#!/usr/bin/env python3
"""Cost of a plugin's cycle at 1 kHz while another one starts late and adds a Point in each of its cycles.

Run with `./run exec python benchmark/late_start.py [CYCLES]`. Both receive the simulated CENTAURO in one process; the
first updates a Handler of `POINTS` Points. Beside it runs at first one that adds nothing and has as many Points: what
that costs the first is what any neighbour costs, by the caches that it fills. Processor time in microseconds of each
cycle; `made` counts those of its Points whose instructions were made anew.
"""

import gc
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

from solfer.components import Component
from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Generator, Plugin, generate
from solfer.points import Handler, LinearPoint
from solfer.simulation import Simulation, SimulationServer

CONFIG = Path(__file__).resolve().parents[1] / "config"
ROBOT = CONFIG / "robots" / "centauro"
LINKS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_7", "arm2_7", "pelvis", "torso_2")
POINTS, PERIOD = 1000, 1e-3
FIRST, EVEN, LATE = "first", "even", "late"


class CountedPoint(LinearPoint):
    """A point that counts how often the instructions of any such point are made."""

    made = 0

    def instructions(self):
        """Count, and return the kernel's instructions."""
        CountedPoint.made += 1
        return super().instructions()


class ManyPoints(Component):
    """Updates many points in each cycle."""

    def init(self) -> None:
        """Make the points."""
        self.points = Handler(CountedPoint(LINKS[index % len(LINKS)], self.model) for index in range(POINTS))

    def update(self) -> None:
        """Update the points."""
        self.points.update()


class MorePoints(Component):
    """Adds a point in each cycle."""

    def init(self) -> None:
        """Begin with one point."""
        self.points = Handler([LinearPoint(LINKS[0], self.model)])

    def update(self) -> None:
        """Add a point, and update all."""
        self.points.add(LinearPoint(LINKS[len(self.points) % len(LINKS)], self.model))
        self.points.update()


def configuration(folder: Path) -> Path:
    """Write the configuration of plugins that command nothing."""
    tree = yaml.safe_load((CONFIG / "centauro.yaml").read_text())["mwoibn"]
    for place in (*tree["layers"].values(), *tree["robot"]["systems"].values()):
        place["file"] = str(CONFIG / place["file"])
    for name in ("actuators", "contacts"):
        tree["ros"]["source"][name]["file"] = str(CONFIG / tree["ros"]["source"][name]["file"])
    module = {key: tree["modules"]["joint_states"][key] for key in ("layer", "robot", "dynamics")}
    module |= {
        "controller": [],
        "class": "solfer.components:Component",
        "mode": "idle",
        "kinematics": True,
        "model_change": False,
    }
    tree["modules"] |= dict.fromkeys((FIRST, EVEN, LATE), module)
    path = folder / "main.yaml"
    path.write_text(yaml.safe_dump({"mwoibn": tree}))
    return path


class Timed:
    """A plugin whose cycles are timed.

    Args:
        plugin: The plugin.
    """

    def __init__(self, plugin: Plugin):
        self._plugin, self._times = plugin, list[float]()

    def cycle(self) -> None:
        """Run one cycle."""
        start = time.thread_time_ns()
        self._plugin.cycle()
        self._times.append(1e-3 * (time.thread_time_ns() - start))

    def report(self, title: str) -> None:
        """Print what the cycles took since the last report, and how many points were made anew."""
        p50, p99 = np.percentile(self._times, (50, 99))
        print(f"{title:<45}{p50:>9.1f}{p99:>9.1f}{max(self._times):>9.1f}{CountedPoint.made:>8}")
        self._times.clear()
        CountedPoint.made = 0


def main() -> None:
    """Print the table."""
    cycles = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    sources = {
        "/robot_description": (ROBOT / "centauro.urdf").read_text(),
        "/robot_semantic_description": (ROBOT / "centauro.srdf").read_text(),
    }
    bus = Bus(sources)
    server = SimulationServer(Simulation.from_file(ROBOT / "robot.yaml"), MemoryMiddleware(bus, "simulator"))
    bus.every(PERIOD, server.cycle)

    def run(*plugins: Timed) -> None:
        for _ in range(cycles):
            bus.run_until(bus.time + PERIOD)
            for one in plugins:
                one.cycle()

    with tempfile.TemporaryDirectory() as folder:
        path = configuration(Path(folder))

        def make(name: str, kind: type[Component]) -> Timed:
            generator = type(f"{kind.__name__}Generator", (Generator,), {"component": kind})
            return Timed(generate(load(path, name), MemoryMiddleware(bus, name), generator))

        first, even, late = make(FIRST, ManyPoints), make(EVEN, ManyPoints), make(LATE, MorePoints)
    bus.run_until(0.5)
    first.cycle()
    even.cycle()
    gc.collect()
    gc.freeze()
    print(f"{'cycle [us]':<45}{'p50':>9}{'p99':>9}{'max':>9}{'made':>8}")
    first.report("first cycle of the first plugin")
    for title in ("first plugin, alone", "the same again"):
        run(first)
        first.report(title)
    run(first, even)
    first.report("first plugin, beside one that adds nothing")
    run(first, late)
    first.report("first plugin, beside the late one")
    late.report("late plugin, a point more each cycle")


if __name__ == "__main__":
    main()
