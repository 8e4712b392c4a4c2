#!/usr/bin/env python3
"""Cost of a shared plugin beside the same components as plugins of their own, on the memory middleware.

Run with `./run exec python benchmark/shared_plugin.py [SECONDS]`. The stand-ins for the components of Fig. 5 work on a
simulated CENTAURO; a fifth one that only reads is added to the shared plugin. The ways take turns, `TURN` seconds each
on a robot of its own, so that all see the same machine. For each: median and 99th percentile of the cycle of all
components, the processor time of a cycle, the median of each stage [us], and how often a cycle computes kinematics and
bias forces; then the median over all turns of what a shared cycle takes of a separate one, and of what one more
component adds.
"""

import gc
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test"))

from form import Figures, parser_of
from support.shared.figure_5 import ORDER, Figure5World, module, write  # noqa: E402

from solfer.plugins.timing.cycle_timing import STAGES  # noqa: E402

READER = "reader"
TURN = 0.1
"""Simulated time in which one way runs [s]."""


class Stopwatch:
    """Times of calls, and what they used of the processor.

    Attributes:
        times: Time of each call [ns].
        used: Processor time of all of them [s].
        stages: What the stages of each call's plugins took together, in the order of `STAGES` [ns].
    """

    def __init__(self) -> None:
        self.times: list[int] = []
        self.used = 0.0
        self.stages: list[list[int]] = []

    def around(self, work, *plugins):
        """Return the same function, measured; it runs one cycle of each of the plugins."""

        def measured():
            used, begin = time.process_time(), time.perf_counter_ns()
            result = work()
            self.times.append(time.perf_counter_ns() - begin)
            self.used += time.process_time() - used
            self.stages.append([sum(times) for times in zip(*(each.timing.times for each in plugins), strict=True)])
            return result

        return measured


def computed(world: Figure5World) -> dict[str, int]:
    """Count what all Robots have computed."""
    robots = {id(plugin.robot.kinematics): plugin.robot for plugin in world.plugins.values()}
    counts = [robot.computations() for robot in robots.values()]
    return {name: sum(each.get(name, 0) for each in counts) for name in ("kinematics", "bias")}


class Way:
    """One of the ways to run the components, on a robot of its own.

    Args:
        name: What it is called.
        world: The robot and the components.
        shared: Whether they are a shared plugin.

    Attributes:
        own: Times of the cycle of the component that only reads, where it is there.
    """

    def __init__(self, name: str, world: Figure5World, shared: bool):
        self._name, self._world = name, world
        world.run(1.0)
        self._watches = [Stopwatch()] if shared else [Stopwatch() for _ in ORDER]
        if shared:
            world.set.cycle = self._watches[0].around(world.set.cycle, *world.plugins.values())
        else:
            for plugin, watch in zip(ORDER, self._watches, strict=True):
                world.plugins[plugin].cycle = watch.around(world.plugins[plugin].cycle, world.plugins[plugin])
        self._before = computed(world)
        self.own = Stopwatch()
        if shared and READER in world.parts:
            world.parts[READER].cycle = self.own.around(world.parts[READER].cycle)

    def run(self) -> float:
        """Let the components work for a turn, and return the median of its cycles [us]."""
        start = len(self._watches[0].times)
        self._world.run(TURN)
        return float(np.median(self._cycles()[start:]))

    def report(self, figures: Figures) -> None:
        """Print the row of this way."""
        cycles = self._cycles()
        used = 1e6 * sum(watch.used for watch in self._watches) / len(cycles)
        counts = {name: (after - self._before[name]) / len(cycles) for name, after in computed(self._world).items()}
        p50, p99 = np.percentile(cycles, (50, 99))
        stages = np.median(np.sum([watch.stages for watch in self._watches], axis=0), axis=0) * 1e-3
        named = dict(zip(STAGES, stages.tolist(), strict=True))
        figures.row(self._name, p50=float(p50), p99=float(p99), cpu=used, **named, **counts)

    def close(self) -> None:
        """End the simulation."""
        self._world.close()

    def _cycles(self) -> np.ndarray:
        return np.sum([watch.times for watch in self._watches], axis=0) * 1e-3


def main() -> None:
    """Measure all ways by turns."""
    parser = parser_of(__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=20.0, help="of each way (default: %(default)g)")
    given = parser.parse_args()
    seconds, figures = given.seconds, Figures(given.json)
    reads = module("Component", "whole", [], **{"class": "solfer.components:Component", "kinematics": True})
    kinds = (("separate", False, ()), ("shared", True, ()), ("shared, one more", True, (READER,)))
    ways = []
    with tempfile.TemporaryDirectory() as folder:
        for name, shared, more in kinds:
            listed = [f"{member}::{member}" for member in (*ORDER, *more)]
            file = write(Path(folder), shared={"plugins": listed}, **{READER: reads})
            ways.append(Way(name, Figure5World(file, shared, time.monotonic_ns), shared))
    gc.collect()
    gc.disable()
    turns = np.array([[way.run() for way in ways] for _ in range(round(seconds / TURN))])
    gc.enable()
    for way in ways:
        way.report(figures)
        way.close()
    separate, shared, more = turns.T
    own = 1e-3 * np.median(ways[-1].own.times)
    figures.row("shared by separate", ratio=float(np.median(shared / separate)))
    figures.row("one more", us=float(np.median(more - shared)), of_its_own_us=float(own))


if __name__ == "__main__":
    main()
