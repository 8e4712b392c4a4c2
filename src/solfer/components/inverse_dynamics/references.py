"""References that a configuration generates, with their velocities and accelerations."""

from typing import cast

import numpy as np

from solfer.config.tasks.references import ReferenceRecord
from solfer.config.tasks.stack import TaskRecord
from solfer.points import Constant, Posture
from solfer.points.space import ORIENTATION, POSE
from solfer.references import build_reference
from solfer.tasks import Task

STEP = 1e-4
"""Time between two velocities of which an acceleration is made [s]."""


class MovingReference:
    """What a task follows over time.

    Args:
        task: The task.
        reference: Its reference.
        record: Its record, with the reference.
        acceleration: Where the acceleration of its rows is written, shape (rows,).

    Raises:
        SolferError: The reference does not fit the task.
    """

    def __init__(self, task: Task, reference: Constant, record: TaskRecord, acceleration: np.ndarray):
        self._reference, self._velocity, self._acceleration = reference, task.velocity, acceleration
        self._own, self._rows = task.velocity.copy(), task.selected
        robot, names = task.point.robot, ()
        quantity = {ORIENTATION: "orientation", POSE: "pose"}.get(reference.space, "position")
        if isinstance(task.point, Posture):
            assert robot is not None
            quantity, names = "posture", tuple(robot.kinematics.dofs[dof] for dof in task.point.dofs)
        self._generator = build_reference(cast(ReferenceRecord, record.reference), quantity, names)
        self._value = np.zeros(self._generator.size)
        self._rates, self._later = np.zeros((2, self._generator.rates))
        self._time = 0.0

    def start(self) -> None:
        """Begin where the reference is."""
        self._time = 0.0
        self._generator.start(self._reference.value)

    def update(self, step: float) -> None:
        """Write the reference after `step` [s], its velocity and its acceleration."""
        self._time += step
        self._generator.at(self._time + STEP, self._value, self._later)
        self._generator.at(self._time, self._reference.value, self._rates)
        self._later -= self._rates
        self._later /= STEP
        np.take(self._later, self._rows, out=self._acceleration, mode="clip")
        np.take(self._rates, self._rows, out=self._velocity, mode="clip")
        self._velocity += self._own
