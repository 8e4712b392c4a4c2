#!/usr/bin/env python3
"""Cost of components in C++ beside the same ones in Python: one that does nothing, joint-space control, Listing 3.

Run with `./run exec python benchmark/native.py [--cycles N]`. A cycle is `let_pass`, `update` and `send` of the
component alone, on CENTAURO; C++ and Python by turns. Times in microseconds; 1 u is one `pinocchio.computeAllTerms` of
the run.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from form import Figures, parser_of
from plugin import ROBOT, unit

from solfer.components import Component
from solfer.plugins.generation.registry import load_class
from solfer.robot import Robot

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test"))
from support.native import LISTINGS, JointSpaceTwin, TaskTrackingTwin, build  # noqa: E402

RATE = 500.0  # [Hz]
TASKS = {
    "way": (0.02, 0.0, -0.05, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1),
    "hands": "manipulation",
    "torso": "torso_2",
}


class Empty(Component):
    """Nothing, in Python."""


def started(made: type[Component], tags: dict | None = None) -> Component:
    """Make a component on a Robot of its own, and start it."""
    robot = Robot.load(*(ROBOT / f"centauro.{kind}" for kind in ("urdf", "srdf")))
    robot.state.position[6:] = 0.3
    component = made(robot, made.Tags(**tags or {}) if made.Tags is not None else None)
    component.set_rate(RATE)
    robot.update()
    if component.dynamics:
        robot.dynamics.update()
    component.init()
    return component


def cycle_times(components: list[Component], cycles: int) -> np.ndarray:
    """Measure cycles of components by turns, shape (cycles, k) [us]."""
    times = np.zeros((cycles, len(components)))
    clock = time.perf_counter_ns
    for row in times:
        for index, component in enumerate(components):
            begin = clock()
            component.let_pass(1.0 / RATE)
            component.update()
            component.send()
            row[index] = 1e-3 * (clock() - begin)
    return times


def main() -> None:
    """Measure each pair."""
    parser = parser_of(__doc__)
    parser.add_argument("--cycles", type=int, default=50_000, help="of each component (default: %(default)d)")
    given = parser.parse_args()
    figures = Figures(given.json)
    size = unit(2000)
    with tempfile.TemporaryDirectory() as folder:
        tested = build(Path(folder) / "libcomponents.so")
        listings = build(Path(folder) / "liblistings.so", source=LISTINGS)
        for title, target, twin, tags in (
            ("nothing", f"{tested}::Empty", Empty, {}),
            ("nothing, with `releases_gil`", f"{tested}::Empty", Empty, {"releases_gil": True}),
            ("joint-space control with gravity", f"{tested}::JointSpace", JointSpaceTwin, {}),
            ("Listing 3", f"{listings}::TaskTracking", TaskTrackingTwin, TASKS),
        ):
            own = {key: value for key, value in tags.items() if key != "releases_gil"}
            times = cycle_times([started(load_class(target), tags), started(twin, own)], given.cycles)
            middle, late = np.percentile(times, (50.0, 99.0), axis=0)
            figures.row(
                title,
                cpp_us=middle[0],
                cpp_u=middle[0] / size,
                cpp_p99_us=late[0],
                python_us=middle[1],
                python_u=middle[1] / size,
                python_p99_us=late[1],
            )
    figures.row("one u", us=size)


if __name__ == "__main__":
    main()
