"""Listing 4 of the paper: how far two points 15 cm before the hands are from a reference point of the robot."""

import argparse
from pathlib import Path

from solfer import Robot
from solfer.points import Handler, LinearPoint, Minus, Norm

CENTAURO = Path(__file__).resolve().parents[1] / "config/robots/centauro/centauro.urdf"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--urdf", default=CENTAURO, help="robot (default: CENTAURO)")
    parser.add_argument("--hands", nargs=2, default=["arm1_7", "arm2_7"], help="links (default: CENTAURO's)")
    parser.add_argument("--base", default="pelvis", help="link (default: %(default)s)")
    arguments = parser.parse_args()
    robot = Robot.load(arguments.urdf, floating_base=True)
    points = Handler(LinearPoint(link, robot) for link in (*arguments.hands, arguments.base))
    points.add(Minus(points[0], points[2]))
    points.add(Minus(points[1], points[2]))
    points.add(Norm(points.end(1)))
    points.add(Norm(points.end(1)))
    points[0].position.set_fixed((0.0, 0.0, -0.15))
    points[1].position.set_fixed((0.0, 0.0, -0.15))
    for angle in (0.0, 0.3, 0.6):
        robot.state.position[6:] = angle
        robot.update()
        points.update(jacobian=False)
        print(f"joints at {angle:g} rad: {points.end(1).value[0]:.6f} m and {points.end(0).value[0]:.6f} m")


if __name__ == "__main__":
    main()
