"""The quadruped Solo 12 stands on its automatic gains; it comes with `pip install -r requirements-examples.txt`.

python examples/quadruped.py [--duration SECONDS]
"""

import argparse
from importlib.metadata import PackageNotFoundError, distribution

import numpy as np

from solfer.simulation import Simulation, read_bundle

URDF = "cmeel.prefix/share/example-robot-data/robots/solo_description/robots/solo12.urdf"


def main() -> None:
    """Stand, then print how far the joints gave way and what the feet carry."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=5.0, help="simulated time [s] (default: %(default)g)")
    duration = parser.parse_args().duration
    try:
        urdf = str(distribution("example-robot-data").locate_file(URDF))
    except PackageNotFoundError:
        parser.exit(2, "error: Solo is not installed\n  expected: pip install -r requirements-examples.txt\n")
    simulation = Simulation.from_file(read_bundle(urdf, floating_base=True))
    start = simulation.q[6:].copy()
    while simulation.time < duration:
        simulation.step()
    weight = sum(force[2] for force in simulation.contacts().values())
    print(f"{simulation.kinematics.size - 6} joints held for {duration:g} s")
    print(f"gave way by at most {np.abs(simulation.q[6:] - start).max():.4f} rad")
    print(f"fastest joint at the end {np.abs(simulation.v[6:]).max():.4f} rad/s")
    print(f"the feet carry {weight:.1f} N of {9.81 * simulation.kinematics.mass:.1f} N")
    simulation.close()


if __name__ == "__main__":
    main()
