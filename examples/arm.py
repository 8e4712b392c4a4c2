"""A KUKA iiwa holds its own weight, with nothing but its URDF and an SRDF with its start.

python examples/arm.py [--duration SECONDS]
"""

import argparse
from pathlib import Path

import numpy as np
import pybullet_data

from solfer.simulation import Simulation, read_bundle

URDF = Path(pybullet_data.getDataPath(), "kuka_iiwa/model.urdf")
SRDF = Path(__file__).with_name("arm.srdf")


def main() -> None:
    """Hold, then print how far the joints gave way."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=5.0, help="simulated time [s] (default: %(default)g)")
    duration = parser.parse_args().duration
    simulation = Simulation.from_file(read_bundle(URDF, SRDF, floating_base=False))
    start = simulation.q.copy()
    while simulation.time < duration:
        simulation.step()
    print(f"{simulation.kinematics.size} joints held for {duration:g} s")
    print(f"gave way by at most {np.abs(simulation.q - start).max():.4f} rad")
    print(f"fastest joint at the end {np.abs(simulation.v).max():.4f} rad/s")
    simulation.close()


if __name__ == "__main__":
    main()
