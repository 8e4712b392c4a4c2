"""Listing 3 of the paper: the centre of mass moves 2 cm down, the hands 5 cm forward as seen from the torso."""

import argparse
from pathlib import Path

import numpy as np

from solfer import Robot
from solfer.numerics.damped import DampedInverse
from solfer.points import Constant, Handler, LinearPoint

CENTAURO = Path(__file__).resolve().parents[1] / "config/robots/centauro/centauro.urdf"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--urdf", default=CENTAURO, help="robot (default: CENTAURO)")
    parser.add_argument("--links", nargs=3, default=["arm1_7", "arm2_7", "torso_2"], help="hands, torso")
    arguments = parser.parse_args()
    robot = Robot.load(arguments.urdf, floating_base=True)
    robot.state.position[6:] = 0.3
    robot.update()
    tasks, references, errors = Handler([robot.center_of_mass]), Handler(), Handler()
    hands, torso = arguments.links[:2], tasks.add(LinearPoint(arguments.links[2], robot))
    relative = [tasks.add(tasks.add(LinearPoint(hand, robot)) - torso) for hand in hands]
    tasks.update()
    for point, way in ((tasks[0], (0.0, 0.0, -0.02)), *((hand, (0.05, 0.0, 0.0)) for hand in relative)):
        errors.add(point - references.add(Constant(point.value + way)))
    inverse, step = DampedInverse(errors.rows, robot.size, 1e-3), np.zeros(robot.size)
    for _ in range(20):
        for part in (robot, tasks, errors):
            part.update()
        robot.state.position -= inverse.solve(errors.jacobian, errors.value, step)
    print(f"{len(references)} tasks are {1e3 * np.linalg.norm(errors.value):.6f} mm from their references")


if __name__ == "__main__":
    main()
