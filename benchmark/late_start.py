#!/usr/bin/env python3
"""Cost of a plugin's cycle at 1 kHz beside others that start late, or add a Point in each of their cycles.

Run with `./run exec python benchmark/late_start.py [CYCLES]`. They receive the simulated CENTAURO in one process; the
first updates a Handler of `POINTS` Points. Before each of its cycles one of its neighbours runs, in turn, so that all
see the same machine:

- none;
- one that has as many Points and adds nothing;
- one that adds a Point, and then updates those and as many as the others;
- one that adds nothing, and then reads and writes `SWEPT` bytes, as much as the processor's nearer caches hold. It has
  nothing to do with Points: what the first one takes longer beside it, it takes longer for the caches alone;
- and, every `STARTS` rounds, the start of a plugin, or as long a time of work that has nothing to do with plugins.

Processor time in microseconds of the first one's cycle after each; `calls` are the Python functions that it calls, and
`made` counts those of its Points whose instructions were made anew.
"""

import gc
import sys
import tempfile
import time
from collections import defaultdict
from contextlib import closing
from pathlib import Path

import numpy as np
import yaml
from form import Figures, parser_of

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
SWEPT, STARTS, MORE = 1 << 21, 50, 100
FIRST, EVEN, LATE, SWEEP, START = "first", "even", "late", "sweep", "start"


class CountedPoint(LinearPoint):
    """A point of the first plugin, which counts how often the instructions of any such point are made."""

    own = 0

    def instructions(self):
        """Count, and return the kernel's instructions."""
        CountedPoint.own += 1
        return super().instructions()


class ManyPoints(Component):
    """Updates many points in each cycle."""

    kind: type[LinearPoint] = LinearPoint

    def init(self) -> None:
        """Make the points."""
        self.points = Handler(self.kind(LINKS[index % len(LINKS)], self.model) for index in range(POINTS))

    def update(self) -> None:
        """Update the points."""
        self.points.update()


class CountedPoints(ManyPoints):
    """Updates as many, which are counted."""

    kind = CountedPoint


class MorePoints(ManyPoints):
    """Adds a point in each cycle, to a Handler of its own that begins anew when it has `MORE`."""

    def init(self) -> None:
        """Make the points that do not change, and one."""
        super().init()
        self._begin()

    def update(self) -> None:
        """Add a point, and update all."""
        if len(self.more) == MORE:
            self._begin()
        self.more.add(LinearPoint(LINKS[len(self.more) % len(LINKS)], self.model))
        self.more.update()
        super().update()

    def _begin(self) -> None:
        self.more = Handler([LinearPoint(LINKS[0], self.model)])


class Sweep(ManyPoints):
    """Reads and writes much memory after its points."""

    def init(self) -> None:
        """Make the points and the memory."""
        super().init()
        self.memory = np.zeros(SWEPT // 8)

    def update(self) -> None:
        """Update the points, and write the memory."""
        super().update()
        self.memory += 1.0


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
    tree["modules"] |= dict.fromkeys((FIRST, EVEN, LATE, SWEEP, START), module)
    path = folder / "main.yaml"
    path.write_text(yaml.safe_dump({"mwoibn": tree}))
    return path


class Calls:
    """Counts the Python functions that are called while it is entered."""

    def __init__(self) -> None:
        self.count = 0

    def __enter__(self) -> "Calls":
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    def _note(self, _frame: object, event: str, _argument: object) -> None:
        self.count += event == "call"


class First:
    """The plugin whose cycles are timed, by what ran before each.

    Args:
        plugin: The plugin.
    """

    def __init__(self, plugin: Plugin):
        self.cycle = plugin.cycle
        self._times = defaultdict[str, list[float]](list)
        self._calls = defaultdict[str, set[int]](set)
        self._made = defaultdict[str, int](int)

    def time(self, before: str, counted: bool) -> None:
        """Run one cycle, and note what it took, or which functions it called."""
        own = CountedPoint.own
        if counted:
            with Calls() as calls:
                self.cycle()
            self._calls[before].add(calls.count)
        else:
            start = time.thread_time_ns()
            self.cycle()
            self._times[before].append(1e-3 * (time.thread_time_ns() - start))
        self._made[before] += CountedPoint.own - own

    def report(self, figures: Figures) -> None:
        """Print a row for each kind of neighbour."""
        for before, times in self._times.items():
            p50, p99 = np.percentile(times, (50, 99))
            calls = ", ".join(map(str, sorted(self._calls[before])))
            counts = {"cycles": len(times), "made": self._made[before], "calls": calls}
            figures.row(before, p50_us=float(p50), p99_us=float(p99), max_us=max(times), **counts)


def work(seconds: float) -> None:
    """Do something else for a time: make, sort and drop objects of Python."""
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        sorted(str(number) for number in range(2000))


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("cycles", nargs="?", type=int, default=2000, help="beside each (default: %(default)s)")
    given = parser.parse_args()
    cycles = given.cycles
    sources = {
        "/robot_description": (ROBOT / "centauro.urdf").read_text(),
        "/robot_semantic_description": (ROBOT / "centauro.srdf").read_text(),
    }
    bus = Bus(sources)
    server = SimulationServer(Simulation.from_file(ROBOT / "robot.yaml"), MemoryMiddleware(bus, "simulator"))
    bus.every(PERIOD, server.cycle)
    with tempfile.TemporaryDirectory() as folder:
        path = configuration(Path(folder))

        def make(name: str, kind: type[Component], middleware: MemoryMiddleware | None = None) -> Plugin:
            generator = type(f"{kind.__name__}Generator", (Generator,), {"component": kind})
            return generate(load(path, name), middleware or MemoryMiddleware(bus, name), generator)

        first, even, late, sweep = (
            make(name, kind)
            for name, kind in ((FIRST, CountedPoints), (EVEN, ManyPoints), (LATE, MorePoints), (SWEEP, Sweep))
        )
        timed = First(first)
        neighbours = {
            "alone": lambda: None,
            "beside one that adds nothing": even.cycle,
            "beside one that adds a point": late.cycle,
            "beside one that adds nothing and sweeps memory": sweep.cycle,
        }
        bus.run_until(0.5)
        for plugin in (first, even, late, sweep):
            plugin.cycle()
        gc.collect()
        gc.freeze()
        took = 0.0
        for cycle in range(cycles):
            for before, run in neighbours.items():
                bus.run_until(bus.time + PERIOD)
                run()
                timed.time(before, counted=cycle % 20 == 10)
            if cycle % STARTS == STARTS - 1:
                bus.run_until(bus.time + PERIOD)
                begin = time.perf_counter()
                with closing(MemoryMiddleware(bus, START)) as middleware:
                    make(START, ManyPoints, middleware).close()
                took = time.perf_counter() - begin
                timed.time("just after another one has started and closed", counted=cycle % (2 * STARTS) < STARTS)
                bus.run_until(bus.time + PERIOD)
                work(took)
                timed.time("just after as long a time of other work", counted=cycle % (2 * STARTS) < STARTS)
    timed.report(Figures(given.json))


if __name__ == "__main__":
    main()
