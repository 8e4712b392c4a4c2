"""Cost of a simulated millisecond of CENTAURO, in parts, and how much faster than real time it runs unthrottled.

python benchmark/simulation.py [STEPS] [--engine NAME]
"""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

from form import Figures, add_engine, parser_of

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.physics import STEP

ROBOT = Path(__file__).resolve().parent.parent / "config" / "robots" / "centauro" / "robot.yaml"


class Stopwatch:
    """Times every call of a method of one object."""

    def __init__(self, owner: object, method: str):
        self.times: list[float] = []
        self._call: Callable = getattr(owner, method)
        setattr(owner, method, self)

    def __call__(self, *arguments: object) -> object:
        """Call the method, and note how long it takes."""
        begin = time.perf_counter()
        result = self._call(*arguments)
        self.times.append(time.perf_counter() - begin)
        return result


def report(figures: Figures, name: str, times: list[float]) -> None:
    """Print one row: median and 99th percentile."""
    ordered = sorted(times)
    figures.row(name, p50_us=1e6 * statistics.median(ordered), p99_us=1e6 * ordered[int(0.99 * len(ordered))])


def measure_parts(steps: int, figures: Figures) -> None:
    """Measure the whole step without stopwatches inside, then its parts."""
    simulation = Simulation.from_file(ROBOT)
    whole = Stopwatch(simulation, "step")
    for _ in range(steps):
        simulation.step()
    parts = {
        "lower level (impedance law)": Stopwatch(simulation.lower_level, "update"),
        "  inertia M": Stopwatch(simulation.kinematics, "inertia"),
        "write torques and speeds": Stopwatch(simulation.body, "apply"),
        "step of the engine": Stopwatch(simulation._engine, "step"),
        "read state": Stopwatch(simulation.body, "read"),
    }
    for _ in range(steps):
        simulation.step()
    contacts = Stopwatch(simulation, "contacts")
    for _ in range(1000):
        simulation.contacts()
    report(figures, "whole step", whole.times[:steps])
    for name, watch in parts.items():
        report(figures, name, watch.times)
    report(figures, "contacts(), on demand", contacts.times)
    simulation.close()


def measure_factor(steps: int, figures: Figures) -> None:
    """Measure simulated time over time, with the server's publications in memory."""
    server = SimulationServer(Simulation.from_file(ROBOT), MemoryMiddleware(Bus(), "simulation"))
    begin = time.perf_counter()
    for _ in range(steps):
        server.cycle()
    figures.row("real-time factor, unthrottled", factor=steps * STEP / (time.perf_counter() - begin))
    server.simulation.close()


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("steps", nargs="?", type=int, default=5000, help="that are timed (default: %(default)s)")
    add_engine(parser)
    given = parser.parse_args()
    measure_parts(given.steps, Figures(given.json))
    measure_factor(given.steps, Figures(given.json))
