"""Robots in random states, and what sits on them: for tests of points."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from support import robots
from support.needs import pybullet_robot

from solfer import Robot

ROOT = Path(__file__).parents[3]
ROBOTS = {
    "centauro": (lambda: ROOT / "config/robots/centauro/centauro.urdf", None, ("arm1_7", "wheel_3")),
    "kuka": (lambda: pybullet_robot("kuka_iiwa/model.urdf"), False, ("lbr_iiwa_link_7", "lbr_iiwa_link_3")),
    "quadruped": (lambda: pybullet_robot("a1/a1.urdf"), True, ("FR_lower", "RL_upper")),
}
"""What finds the URDF, whether the base floats, and two links."""

STATES = 50
WHEEL = {"ring": 0.05, "tube": 0.02, "axis": (0.3, 1.0, -0.2), "center": (0.0, 0.1, 0.0)}
SLOPE = (0.1, -0.2, 1.0)
OFFSET, TURN = (0.1, -0.2, 0.05), np.array((0.1, -0.5, 0.3, 0.8))


def load(name: str) -> tuple[Robot, tuple[str, str]]:
    """Load a robot and two of its links."""
    find, floating_base, links = ROBOTS[name]
    return robots.load(find(), floating_base=floating_base), links


def states(robot: Robot) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Random positions and velocities; the base is tilted by up to 70 degrees."""
    generator = np.random.default_rng(7)
    for _ in range(STATES):
        position = generator.uniform(-1.0, 1.0, robot.size)
        if robot.kinematics.base is not None:
            position[3:6] = np.radians(generator.uniform(-70.0, 70.0, 3))
        yield position, generator.uniform(-1.0, 1.0, robot.size)


def put(robot: Robot, position: np.ndarray, velocity: np.ndarray) -> None:
    """Bring the robot into a state."""
    robot.state.position[:], robot.state.velocity[:] = position, velocity
    robot.update()


def accelerate(robot: Robot, seed: int = 5) -> None:
    """Bring the robot into a random state, with random accelerations and efforts."""
    generator = np.random.default_rng(seed)
    for array in (robot.state.acceleration, robot.state.torque):
        array[:] = generator.uniform(-10.0, 10.0, robot.size)
    put(robot, *generator.uniform(-1.0, 1.0, (2, robot.size)))
