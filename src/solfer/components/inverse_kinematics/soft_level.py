"""Damping of a level of tasks, as large errors need it."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.components.following.task_reference import TaskReference
from solfer.tasks import Task


class SoftLevel:
    """A level of tasks that comes to rest where its references cannot be reached.

    Near a singularity a small step of the joints turns the Jacobian J of a point: by as much as the point moves, over a
    length L of the size of the limbs. A step that requests the way s = K |e| T, and finds too small a singular
    value, goes too far, comes back in the next cycle, and so on. With the damping D^2 + L s instead of D^2 it goes no
    further than J holds, and the joints settle where J^T e = 0, the nearest there is. All tasks of a level get the
    same, so that their weights stay, but for those that are held where they have come to rest: nothing moves them. A
    posture gets less where errors are large: where an arm is stretched out, it decides to which side the elbow bends on
    the way back. Source: T. Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method",
    IEEE Transactions on Robotics 27(5), 2011, with D^2 + |e|^2 / 2 for a step without K T.

    Args:
        tasks: Tasks of the level.
        targets: Those of them that follow what is desired.
        length: L [m]; 0: the damping stays that of the tasks.
    """

    def __init__(self, tasks: Sequence[Task], targets: Sequence[TaskReference], length: float):
        self._targets = tuple(targets)
        self._length = length
        followed = {target.task: target for target in targets}
        self._dampings = [(task, task.damping.copy(), followed.get(task)) for task in tasks]
        self._is_soft = False
        self._compare()

    def take_damping(self, task: Task, damping: np.ndarray) -> None:
        """Go on from another damping of a task, shape (rows,)."""
        for each, own, _ in self._dampings:
            if each is task:
                own[:] = damping
                if not self._is_soft:
                    task.damping[:] = damping
                self._compare()

    def _compare(self) -> None:
        self._least = min(float(damping.min()) for _, damping, _ in self._dampings) ** 2

    def update(self) -> None:
        """Measure how far the targets are from their references, and damp all tasks of the level accordingly."""
        distance = 0.0
        for one in self._targets:
            distance += one.measure()
        if not self._length:
            return
        added = self._length * distance
        if added > 1e-3 * self._least:  # else the damping is negligible beside the least that the level has
            # without a reference of others: all of a small damping, a tenth of one far above 1e-4 m2
            others = added * (1e-4 + 0.1 * added) / (1e-4 + added)
            for task, damping, target in self._dampings:
                is_held = target is not None and target.is_held
                part = others if target is None else added
                task.damping[:] = damping if is_held else math.sqrt(part + float(damping[0]) ** 2)
            self._is_soft = True
        elif self._is_soft:
            for task, damping, _ in self._dampings:
                task.damping[:] = damping
            self._is_soft = False
