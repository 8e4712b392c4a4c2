"""Stacks of tasks on CENTAURO, and points with given Jacobians."""

import numpy as np

from solfer.points import CenterOfMass, FrameOrientation, LinearPoint, Point
from solfer.tasks import Task


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


def repeating(robot, seed, noise, damping):
    """Three random levels of 7 DoFs that repeat and contradict each other, and themselves, but for some noise."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 4))
    rows = random.normal(size=(count, 7))
    first = np.vstack((rows, random.uniform(-2.0, 2.0, (1, count)) @ rows))
    second = np.vstack((random.uniform(-2.0, 2.0, (2, count)) @ rows, random.normal(size=(1, 7))))
    second += noise * random.normal(size=(3, 7))
    third = np.vstack((first[:1], second[2:], random.normal(size=(2, 7)))) + noise * random.normal(size=(4, 7))
    return [
        Task(name, Rows(robot, matrix), velocity=random.uniform(-9.0, 9.0, len(matrix)), damping=damping)
        for name, matrix in (("first", first), ("second", second), ("third", third))
    ]


def largest_change(tasks, make):
    """Compute the largest change of J dq of a level by those after it; `make` makes the solver of some levels."""
    velocities = [make(tasks[: count + 1]).update().copy() for count in range(len(tasks))]
    return max(
        np.abs(task.point.jacobian @ (after - velocities[index])).max()
        for index, task in enumerate(tasks)
        for after in velocities[index:]
    )
