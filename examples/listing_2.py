"""Listing 2 of the paper: inverse kinematics of one point of a robot, which moves 5 cm up."""

import argparse
from pathlib import Path

import numpy as np

from solfer import Robot
from solfer.numerics.damped import DampedInverse
from solfer.points import Constant, LinearPoint, Minus

CENTAURO = Path(__file__).resolve().parents[1] / "config/robots/centauro/centauro.urdf"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--urdf", default=CENTAURO, help="robot (default: CENTAURO)")
    parser.add_argument("--link", default="arm1_7", help="link that moves (default: %(default)s)")
    arguments = parser.parse_args()
    robot = Robot.load(arguments.urdf, floating_base=False)
    robot.state.position[:] = 0.3
    robot.update()
    task = LinearPoint(arguments.link, robot)
    task.update()
    reference = Constant(task.value + (0.0, 0.0, 0.05))
    error = Minus(reference, task)
    inverse, step = DampedInverse(error.rows, robot.size, 1e-3), np.zeros(robot.size)
    for _ in range(20):
        robot.update()
        task.update()
        error.update()
        robot.state.position += inverse.solve(task.jacobian, error.value, step)
    print(f"{arguments.link} is {1e3 * np.linalg.norm(error.value):.6f} mm from its reference")


if __name__ == "__main__":
    main()
