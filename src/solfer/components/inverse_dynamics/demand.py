"""The accelerations that tasks and contacts demand."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solfer.components.following.task_reference import TaskReference
from solfer.components.inverse_dynamics.drift import TaskDrift
from solfer.components.inverse_dynamics.ground import Ground
from solfer.model.state import State
from solfer.tasks import Stack


class FedReference(NamedTuple):
    """A reference that the configuration generates.

    Attributes:
        task: Name of its task.
        velocity: Its velocity with the task's weights, shape (rows,); live.
        target: What others may give it; None: nothing.
    """

    task: str
    velocity: np.ndarray
    target: TaskReference | None


class DemandedAccelerations:
    """What a QP is to reach: W r of its tasks, and the accelerations of its contacts.

    Args:
        stack: The tasks.
        drift: dJ/dt v of its rows.
        aims: Where points of the drift look, and where those of the tasks do, shape (3,) each [m]; live.
        fed: References whose accelerations are known.
        contact_rows: Number k of rows of all contacts.
        settle: How fast contacts come to rest [1/s].

    Attributes:
        stack: See above.
        rows: Rows of each task by its name.
        velocity_gains: Gain of each row's velocity, shape (rows,) [1/s]; live.
        roots: Root of each row's weight, shape (rows,); live.
        tasks: W r, shape (rows,); live.
        contacts: Accelerations of the contacts' rows, shape (k,) [m/s^2]; live.
        slip: Velocities of these rows, shape (k,) [m/s]; live.
        settle: See above; may be set.
        is_smooth: Whether the next velocities of references follow those before.
    """

    def __init__(
        self,
        stack: Stack,
        drift: TaskDrift,
        aims: Sequence[tuple[np.ndarray, np.ndarray]],
        fed: Sequence[FedReference],
        *,
        contact_rows: int,
        settle: float,
    ):
        self.stack = stack
        self._drift = drift
        self._aims = tuple(aims)
        ends = np.cumsum([task.rows for task in stack.tasks]).tolist()
        self.rows = {task.name: slice(end - task.rows, end) for task, end in zip(stack.tasks, ends, strict=True)}
        self.velocity_gains, self.roots, self.tasks = np.zeros((3, len(stack.velocity)))
        self._fed, self._before, self._rates = np.zeros((3, len(stack.velocity)))
        self._fed_rows = [(self.rows[each.task], each.velocity, each.target) for each in fed]
        self.contacts, self.slip = np.zeros((2, contact_rows))
        self.settle = settle
        self.is_smooth = False

    def start(self) -> None:
        """Begin with references at rest."""
        self._fed[:] = 0.0
        self.is_smooth = False

    def feed(self, step: float) -> None:
        """Compute the accelerations of references that are generated in a time [s]; those of others are too rough."""
        for rows, velocity, target in self._fed_rows:
            fed = self._fed[rows]
            before = self._before[rows]
            if target is not None and not target.is_generated:
                fed[:] = 0.0
            elif self.is_smooth:
                np.subtract(velocity, before, out=fed)
                fed /= step
            before[:] = velocity
        self.is_smooth = True

    def update(self, state: State, ground: Ground) -> None:
        """Compute both at a state, with what contacts hold."""
        stack = self.stack
        stack.update()
        for look, aim in self._aims:
            look[:] = aim
        self._drift.update(state.position, state.velocity)
        np.dot(stack.jacobian, state.velocity, out=self._rates)
        np.subtract(stack.velocity, self._rates, out=self.tasks)
        self.tasks *= self.velocity_gains
        np.multiply(self.roots, self._fed, out=self._rates)
        self.tasks += self._rates
        self.tasks -= self._drift.value
        np.dot(ground.jacobian, state.velocity, out=self.slip)
        np.multiply(self.slip, -self.settle, out=self.contacts)
        self.contacts -= ground.rows.offset
