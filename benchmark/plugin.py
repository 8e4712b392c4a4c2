#!/usr/bin/env python3
"""Cost of one cycle of `joint_states` on the simulated CENTAURO, from read to write, without transport.

Run with `./run exec python benchmark/plugin.py [CYCLES]`. Times in microseconds; 1 u is one
`pinocchio.computeAllTerms` on the same robot in the same run, so that machines can be compared.
"""

import gc
import time
from pathlib import Path

import numpy as np
import pinocchio
from form import Figures, parser_of

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer

CONFIG = Path(__file__).resolve().parents[1] / "config"
ROBOT = CONFIG / "robots" / "centauro"


def measure(work, cycles: int, between=lambda: None) -> tuple[float, float]:
    """Measure `work`, with `between` before each call: median and 99th percentile [us]."""
    times = np.zeros(cycles)
    for index in range(cycles):
        between()
        start = time.perf_counter_ns()
        work()
        times[index] = 1e-3 * (time.perf_counter_ns() - start)
    return float(np.median(times)), float(np.percentile(times, 99))


def unit(cycles: int) -> float:
    """Measure the median of `computeAllTerms` [us]."""
    model = pinocchio.buildModelFromUrdf(str(ROBOT / "centauro.urdf"))
    data, q, v = model.createData(), pinocchio.neutral(model), np.zeros(model.nv)
    return measure(lambda: pinocchio.computeAllTerms(model, data, q, v), cycles)[0]


def start() -> tuple[Bus, Plugin]:
    """Start a plugin; returns the bus that it shares with the simulated robot, too."""
    bus = Bus(
        {
            "/robot_description": (ROBOT / "centauro.urdf").read_text(),
            "/robot_semantic_description": (ROBOT / "centauro.srdf").read_text(),
        }
    )
    server = SimulationServer(Simulation.from_file(ROBOT / "robot.yaml"), MemoryMiddleware(bus, "simulator"))
    bus.every(1e-3, server.cycle)
    middleware = MemoryMiddleware(bus, "joint_states")
    plugin = generate(load(CONFIG / "centauro.yaml", "joint_states"), middleware, Registry().find("joint_states"))
    bus.run_until(0.5)
    plugin.cycle()
    return bus, plugin


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("cycles", nargs="?", type=int, default=2000, help="that are timed (default: %(default)s)")
    given = parser.parse_args()
    cycles, figures = given.cycles, Figures(given.json)
    bus, plugin = start()
    gc.collect()
    gc.freeze()
    one = unit(cycles)
    period = 1.0 / plugin.rate
    for title, state in (("at rest", None), ("in a ramp", "mammal_wide_high")):
        if state is not None:
            bus.call("joint_states/trajectory", state=state, speed=1e-2)
        median, p99 = measure(plugin.cycle, cycles, lambda: bus.run_until(bus.time + period))
        figures.row(title, p50_us=median, p99_us=p99, p50_u=median / one)
    figures.row("1 u: computeAllTerms", p50_us=one)


if __name__ == "__main__":
    main()
