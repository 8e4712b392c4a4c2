"""Stacks of tasks on CENTAURO, and points with given Jacobians."""

from pathlib import Path

import numpy as np

from solfer.points import CenterOfMass, FrameOrientation, LinearPoint, Point
from solfer.tasks import Task

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro/centauro.urdf"


def at_random(robot, seed=3):
    """Put the robot into a random posture that bends all joints a little."""
    robot.state.position[:] = np.random.default_rng(seed).uniform(-0.4, 0.4, robot.size)
    robot.update()
    return robot


class Rows(Point):
    """A point with a given Jacobian."""

    def __init__(self, robot, matrix):
        self.matrix = np.array(matrix, dtype=float)
        super().__init__(len(matrix), robot)

    def compute(self):
        self.value[:] = 0.0

    def compute_jacobian(self):
        self.jacobian[:, : self.matrix.shape[1]] = self.matrix


def stack_of(robot, **tags):
    """Centre of mass above two hands, one of them relative to the torso, above an orientation."""
    torso = LinearPoint("torso_2", robot)
    points = {
        "com": CenterOfMass(robot),
        "left": LinearPoint("arm1_7", robot) - torso,
        "right": LinearPoint("arm2_7", robot),
        "torso": FrameOrientation("torso_2", robot),
    }
    return [Task(name, point, 2.0, velocity=np.arange(1.0, 4.0), **tags) for name, point in points.items()]
