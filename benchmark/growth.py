"""How loading a robot and inverting its inertia grow with the number of its joints.

    python benchmark/growth.py [JOINTS...]

For a chain of each length, in a process of its own: the time to load it, the largest memory of the process, and the
time of one inverse of its inertia matrix, beside that of `numpy.linalg.inv` for the same matrix in the same run.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
from form import Figures, parser_of

from solfer.supervision import supervise

SIZES = (10, 20, 30, 50, 100, 200, 500)
REPEATS = 30
LINK = (
    '<link name="l{0}"><inertial><origin xyz="0.05 0 0"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="j{0}" type="revolute"><parent link="l{1}"/><child link="l{0}"/><origin xyz="0.1 0 0"/>'
    '<axis xyz="0 {2} {3}"/><limit lower="-1" upper="1" velocity="1" effort="10"/></joint>'
)


def chain(size: int) -> str:
    """Write the URDF of a chain whose axes alternate."""
    links = "\n".join(LINK.format(index, index - 1, index % 2, 1 - index % 2) for index in range(1, size + 1))
    return f'<robot name="chain"><link name="l0"/>{links}</robot>'


def best(call: Callable[[], object]) -> float:
    """Measure the shortest of several calls [us]."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times)


def measure(size: int) -> dict[str, float]:
    """Measure one row of the table, in this process."""
    from solfer import Robot

    text, start = chain(size), time.perf_counter()
    robot = Robot.load(text, floating_base=False)
    loaded = time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    robot.state.position[:] = np.random.default_rng(0).uniform(-0.5, 0.5, size)
    dynamics = robot.dynamics
    inertia, _ = dynamics.inertia, dynamics.inertia_inverse
    own = best(dynamics._recursion.compute_inverse)
    numpy = best(lambda: np.linalg.inv(inertia))
    return {"load_s": loaded, "memory_mb": memory, "inverse_us": own, "numpy_us": numpy, "ratio": own / numpy}


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("sizes", nargs="*", type=int, metavar="JOINTS", help=f"lengths of chains (default: {SIZES})")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(measure(options.one)))
        return
    figures = Figures(options.json)
    for size in options.sizes or SIZES:
        command = [sys.executable, __file__, "--one", str(size)]
        row = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
        figures.row(f"{size} joints", **row)


if __name__ == "__main__":
    supervise()
    main()
