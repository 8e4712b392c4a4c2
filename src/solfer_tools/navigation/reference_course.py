"""References of tasks and joints on their topics."""

from concurrent.futures import Future
from pathlib import Path

import numpy as np

from solfer.config import read
from solfer.config.tasks.references import ReferenceRecord, ReferencesRecord
from solfer.errors import UnknownName
from solfer.interfaces.task_references import REFERENCE_MESSAGES, GetReference, ReferenceReply
from solfer.interfaces.trajectories import TRAJECTORY, JointTrajectory, TrajectoryPoint
from solfer.references import ReferenceGenerator, build_reference, joints_of
from solfer.transport import JointMessage, Middleware, Reader
from solfer.transport.declared.fields import message_of
from solfer.transport.messages import VectorMessage
from solfer_tools.navigation.course import STALE_AGE, Course

ANSWER_TIMEOUT = 30.0
"""Longest time until a target says where a reference is [s]."""


class BegunReference:
    """Requests where the references of a target begin.

    Args:
        middleware: Carries the requests.
        service: Name of the service.

    Attributes:
        service: See above.
    """

    def __init__(self, middleware: Middleware, service: str):
        self._middleware = middleware
        self.service = service
        self._answer: Future[ReferenceReply] | None = None

    def values(self, task: str) -> np.ndarray | str:
        """Return the numbers of a task's reference, shape (n,), or what is missing; one task after the other."""
        if self._answer is None:
            self._answer = self._middleware.request(
                self.service, "solfer/GetReference", GetReference(task), reply=ReferenceReply, timeout=ANSWER_TIMEOUT
            )
        if not self._answer.done():
            return f"an answer of {self.service}"
        reply = self._answer.result()
        self._answer = None
        if not reply.success:  # it may not have started yet
            return f"{self.service}, which refuses: {reply.message}"
        return np.array(reply.values)


class _Reference:
    """A reference, and where it is published."""

    def __init__(self, name: str, record: ReferenceRecord, generator: ReferenceGenerator):
        self.name = name
        self.record = record
        self.generator = generator
        self.is_placed = False
        self._position = np.zeros(generator.size)
        self._velocity = np.zeros(generator.rates)

    def place(self, values: np.ndarray) -> None:
        """Begin at a value."""
        self.generator.start(values)
        self.is_placed = True

    def at(self, time: float) -> np.ndarray:
        """Return the value at a time [s], shape (n,); live."""
        self.generator.at(time, self._position, self._velocity)
        return self._position


class _TaskReference(_Reference):
    """The reference of a task of `inverse_kinematics`."""

    def __init__(self, middleware: Middleware, target: str, name: str, record: ReferenceRecord, quantity: str):
        super().__init__(name, record, build_reference(record, quantity))
        self._begun = BegunReference(middleware, f"{target}/get_reference")
        self.writer = middleware.declared_writer(f"{target}/{name}/reference", REFERENCE_MESSAGES[quantity][0])

    def awaits(self) -> str:
        """Request the place of the reference; return what is missing."""
        values = self._begun.values(self.name)
        if isinstance(values, str):
            return values
        self.place(values)
        return ""

    def publish(self, time: float, pace: float) -> None:
        """Publish where it is at a time [s]."""
        self.writer.write(VectorMessage("", self.at(time).copy()))


class _JointReference(_Reference):
    """The reference of joints, which follow trajectories."""

    def __init__(self, middleware: Middleware, target: str, states: str, record: ReferenceRecord):
        self._names = tuple(joints_of(record))
        super().__init__("joints", record, build_reference(record, "posture", self._names))
        self.writer = middleware.declared_writer(f"{target}/joint_trajectory", TRAJECTORY)
        self._reader: Reader = middleware.reader(states, "sensor_msgs/JointState")

    def awaits(self) -> str:
        """Read where the joints are; returns what is missing."""
        self._reader.read()
        if self._reader.age() > STALE_AGE:
            return f"positions of joints on {self._reader.topic}"
        message: JointMessage = self._reader.message
        for name in self._names:
            if name not in message.names:
                raise UnknownName("joint", name, message.names, where=self.record.where(self.record.kind))
        if message.position is None:
            return f"positions of joints on {self._reader.topic}"
        values = message.position[[message.names.index(name) for name in self._names]]
        if not np.isfinite(values).all():
            return f"finite numbers on {self._reader.topic}"
        self.place(values)
        return ""

    def publish(self, time: float, pace: float) -> None:
        """Publish where the joints are to be a little after a time [s], and where they come to rest without another."""
        # by which a message is ahead of the joints; without another one they brake in the same time after it [s]
        lead = 0.1
        position = self.at(time + pace * lead)
        velocity = pace * self._velocity
        rest = position + 0.5 * lead * velocity
        points = (
            TrajectoryPoint(tuple(position.tolist()), tuple(velocity.tolist()), time_from_start=lead),
            TrajectoryPoint(tuple(rest.tolist()), (0.0,) * len(rest), time_from_start=2.0 * lead),
        )
        self.writer.write(message_of(TRAJECTORY, JointTrajectory(joint_names=self._names, points=points)))


class ReferenceCourse(Course):
    """Publishes references of tasks and of joints. What ends or falls silent stays at its last one.

    Each begins where its task's reference, or its joint, is when all of them are known.

    Args:
        middleware: Carries all of it.
        record: The references.
        target: Namespace of the tasks: a module with `inverse_kinematics`.
        joints: Namespace of `joint_trajectory`.
        states: Topic with the positions of the joints.

    Raises:
        SolferError: A reference is wrong.
    """

    def __init__(
        self,
        middleware: Middleware,
        record: ReferencesRecord,
        target: str,
        joints: str = "joint_states",
        states: str = "joint_states",
    ):
        self._references: list[_TaskReference | _JointReference] = [
            _TaskReference(middleware, target, name, record=each, quantity=quantity)
            for quantity, named in (
                ("position", record.positions),
                ("orientation", record.orientations),
                ("pose", record.poses),
            )
            for name, each in named.items()
        ]
        if record.joints is not None:
            self._references.append(_JointReference(middleware, joints, states, record=record.joints))
        self.writers = tuple(each.writer for each in self._references)
        self.count = len(self._references)
        self._time = 0.0

    def awaits(self) -> str:
        """See `Course.awaits`.

        Raises:
            SolferError: There is no such task or joint.
        """
        missing = (each.awaits() for each in self._references if not each.is_placed)
        return next((each for each in missing if each), "")

    def step(self, period: float, pace: float) -> bool:
        """See `Course.step`."""
        self._time += period * pace
        self._publish(pace)
        return self.left > 0.0

    def rest(self) -> None:
        """See `Course.rest`; references stay where they are."""
        if all(each.is_placed for each in self._references):
            self._publish(0.0)

    @property
    def number(self) -> int:
        """How many references have ended, and one; see `Course.number`."""
        return min(self.count - len(self._moving()) + 1, self.count)

    @property
    def name(self) -> str:
        """Names of the references that move; see `Course.name`."""
        return ", ".join(each.name for each in self._moving()) or self._references[-1].name

    @property
    def left(self) -> float:
        """See `Course.left`; inf where one has no end."""
        return max(0.0, max(each.generator.duration for each in self._references) - self._time)

    def _moving(self) -> list[_TaskReference | _JointReference]:
        return [each for each in self._references if each.generator.duration > self._time]

    def _publish(self, pace: float) -> None:
        for each in self._references:
            each.publish(self._time, pace)


def read_references(path: str | Path) -> ReferencesRecord:
    """Read a file of references.

    Raises:
        SolferError: The file is missing or wrong.
        SolferErrors: In several places.
    """
    return read(path, ReferencesRecord)
