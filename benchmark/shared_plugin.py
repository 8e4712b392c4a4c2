#!/usr/bin/env python3
"""Cost of a shared plugin beside the same components as plugins of their own, on the memory middleware.

Run with `./run exec python benchmark/shared_plugin.py [SECONDS]`. The stand-ins for the components of Fig. 5 work on a
simulated CENTAURO; a fifth one that only reads is added to the shared plugin. For each way: median and 99th percentile
of the cycle of all components, the processor time of a cycle [us], and how often a cycle computes kinematics and bias
forces.
"""

import gc
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test"))

from support.shared.figure_5 import ORDER, SharedWorld, module, write

READER = "reader"


class Stopwatch:
    """Times of calls, and what they used of the processor.

    Attributes:
        times: Time of each call [ns].
        used: Processor time of all of them [s].
    """

    def __init__(self) -> None:
        self.times: list[int] = []
        self.used = 0.0

    def around(self, work):
        """Return the same function, measured."""

        def measured():
            used, begin = time.process_time(), time.perf_counter_ns()
            result = work()
            self.times.append(time.perf_counter_ns() - begin)
            self.used += time.process_time() - used
            return result

        return measured


def computed(world: SharedWorld) -> dict[str, int]:
    """Count what all Robots have computed."""
    robots = {id(plugin.robot.kinematics): plugin.robot for plugin in world.plugins.values()}
    counts = [robot.computations() for robot in robots.values()]
    return {name: sum(each.get(name, 0) for each in counts) for name in ("kinematics", "bias")}


def measure(world: SharedWorld, shared: bool, seconds: float) -> str:
    """Let the components work, and describe what it cost."""
    world.run(1.0)
    watches = [Stopwatch()] if shared else [Stopwatch() for _ in ORDER]
    if shared:
        world.set.cycle = watches[0].around(world.set.cycle)
    else:
        for name, watch in zip(ORDER, watches, strict=True):
            world.plugins[name].cycle = watch.around(world.plugins[name].cycle)
    before = computed(world)
    gc.collect()
    gc.disable()
    world.run(seconds)
    gc.enable()
    cycles = np.sum([watch.times for watch in watches], axis=0) * 1e-3
    used = 1e6 * sum(watch.used for watch in watches) / len(cycles)
    counts = ", ".join(f"{(after - before[name]) / len(cycles):.2f} {name}" for name, after in computed(world).items())
    return f"{np.median(cycles):8.1f} {np.percentile(cycles, 99):8.1f} {used:8.1f}   {counts}"


def main(seconds: float) -> None:
    """Measure each way, alternating."""
    reads = module("Component", "whole", [], **{"class": "solfer.components:Component", "kinematics": True})
    print(f"{'way':24} {'p50':>8} {'p99':>8} {'CPU':>8}   per cycle")
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(3):
            for way, shared, more in (
                ("separate", False, ()),
                ("shared", True, ()),
                ("shared, one more", True, (READER,)),
            ):
                listed = [f"{name}::{name}" for name in (*ORDER, *more)]
                file = write(Path(folder), shared={"plugins": listed}, **{READER: reads})
                world = SharedWorld(file, shared, time.monotonic_ns)
                print(f"{way:24} {measure(world, shared, seconds)}", flush=True)
                world.close()


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 5.0)
