"""References that a configuration generates, and postures that follow one."""

import math
from typing import cast

import numpy as np

from solfer.components.following.filtered import FeedForward
from solfer.components.following.quantity import PoseNumbers
from solfer.components.following.tags import MotionRecord
from solfer.config.tasks.references import ReferenceRecord
from solfer.config.tasks.stack import TaskRecord
from solfer.errors import ComponentError
from solfer.numerics.planar_move import PlanarMove
from solfer.points import Constant, Posture
from solfer.references import ReferenceGenerator, build_reference
from solfer.tasks import Task

_SPEED_SLACK = 1.0 + 1e-6
"""Relative slack of speeds, for those that were computed to be the largest."""


class GeneratedPosture:
    """A task on a posture whose reference is generated.

    Args:
        task: The task.
        reference: What it follows.
        record: Its record, with the reference.
        limits: Velocity limits of the joints, shape (n,) [rad/s, m/s].

    Raises:
        SolferError: The reference does not fit the joints, or is faster than they may be.
    """

    def __init__(self, task: Task, reference: Constant, record: TaskRecord, limits: np.ndarray):
        self._task = task
        self._reference = reference
        dofs = cast(Posture, task.point).dofs
        assert task.point.robot is not None
        self._names = tuple(task.point.robot.kinematics.dofs[dof] for dof in dofs)
        self._record = cast(ReferenceRecord, record.reference)
        self._generator = build_reference(self._record, "posture", self._names)
        self._limits = limits[dofs]
        self._feed_forward = FeedForward(task)
        self._rates = np.zeros(len(dofs))
        self._feed_forward.connect(self._rates, is_used=True)
        self._time = 0.0
        self._require_speeds()

    def start(self) -> None:
        """Begin where the joints are; see `ReferenceGenerator.start`."""
        self._time = 0.0
        self._generator.start(self._reference.value)
        self._require_speeds()
        self._rates[:] = 0.0
        self._feed_forward.write(1.0)

    def update(self, step: float, pace: float) -> None:
        """Write reference and velocity of a cycle.

        Args:
            step: Time by which it goes on [s].
            pace: Share of its speed.
        """
        self._time += step * pace
        self._generator.at(self._time, self._reference.value, self._rates)
        self._feed_forward.write(pace)

    def _require_speeds(self) -> None:
        fastest = np.abs(self._generator.velocities()).max(axis=0)
        beyond = np.flatnonzero(fastest > self._limits * _SPEED_SLACK)
        if len(beyond):
            joint = int(beyond[0])
            raise ComponentError(
                f"a speed of {fastest[joint]:.4g} rad/s of joint '{self._names[joint]}'",
                where=self._record.where(self._record.kind),
                expected=f"at most {self._limits[joint]:.4g} rad/s, the velocity limit of the joint",
            )


class GeneratedReference:
    """The reference of a task that is generated until one comes from outside.

    Args:
        generator: Generates it.
        numbers: Its numbers.

    Attributes:
        is_running: Whether it goes on.
        value: Where it is, shape (numbers.size,).
    """

    def __init__(self, generator: ReferenceGenerator, numbers: PoseNumbers):
        self.is_running = False
        self.value = np.zeros(numbers.size)
        self._generator = generator
        self._numbers = numbers
        self._speeds = np.zeros(3 if numbers.size < 7 else 6)
        self._time = 0.0
        self._moves: list[PlanarMove] = []

    def start(self, value: np.ndarray) -> None:
        """Begin where the point is."""
        self.is_running = True
        self._time = 0.0
        self._moves.clear()
        self._generator.start(value)

    def advance(self, step: float) -> None:
        """Go on by some time [s]; it ends where it stays."""
        self._time += step
        self._generator.at(self._time, self.value, self._speeds)
        for move in self._moves:
            self._numbers.displace(move, self.value)
        self.is_running = self._time < self._generator.duration

    def displace(self, move: PlanarMove) -> None:
        """Move with the base."""
        if self.is_running:
            self._moves.append(move)


def require_speeds(generator: ReferenceGenerator, record: ReferenceRecord, motion: MotionRecord) -> None:
    """Check that a reference is no faster than references of the task may be.

    Raises:
        ComponentError: It is.
    """
    rows = generator.velocities()
    linear = rows[:, :3] if generator.size != 4 else rows[:, :0]
    angular = rows[:, -3:] if generator.size != 3 else rows[:, :0]
    for part, most, key, unit in (
        (linear, motion.speed, "speed", "m/s"),
        (angular, motion.turn_speed, "turn_speed", "rad/s"),
    ):
        fastest = math.sqrt(float(np.square(part).sum(axis=1).max()))
        if fastest > most * _SPEED_SLACK:
            raise ComponentError(
                f"a speed of {fastest:.4g} {unit}",
                where=record.where(record.kind),
                expected=f"at most {most:g} {unit}, the '{key}' of the task's motion",
            )
