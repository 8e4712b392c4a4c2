"""How others set and read the references of tasks: services, topics and an action."""

from collections.abc import Callable
from typing import Any

from solfer.components.following.task_reference import WORLD, TaskReference
from solfer.config.tasks.stack import TaskLevelsRecord, TaskRecord
from solfer.errors import SizeMismatch, UnknownName
from solfer.interfaces.declaration import Accepted, Action, Outcome, Service, TopicIn, TopicOut
from solfer.interfaces.task_references import (
    REFERENCE_MESSAGES,
    GetReference,
    MovePoint,
    ReachFeedback,
    ReachGoal,
    ReachResult,
    ReferenceReply,
    SetReference,
    TaskReferences,
    numbers_of,
    pose_of,
)


class ReferenceInterface:
    """Declarations of a component whose tasks have references.

    Args:
        targets: Tasks that others may give references to, by name.
        record: The tasks' configuration.
    """

    def __init__(self, targets: dict[str, TaskReference], record: TaskLevelsRecord):
        self._targets = targets
        self._list = tuple(targets.values())
        self._shown = _shown(record, targets)
        self._reaching: tuple[TaskReference, ...] = ()

    def reset(self) -> None:
        """Forget what was requested."""
        self._reaching = ()

    def services(self) -> tuple[Service, ...]:
        """Offer `reference`, `get_reference`, and `ub_reference` as the original has it."""
        return (
            Service("reference", "solfer/SetReference", SetReference, reply=Accepted, handler=self.set_reference),
            Service(
                "get_reference",
                "solfer/GetReference",
                GetReference,
                reply=ReferenceReply,
                handler=self.get_reference,
                commands=False,
            ),
            Service("ub_reference", "solfer/MovePoint", MovePoint, reply=Accepted, handler=self.move_point),
        )

    def topics(self) -> tuple[Any, ...]:
        """Receive references of all tasks, each on a topic of its own: `<name>/<task>/reference`; publish them all."""
        received = (
            TopicIn(
                f"{target.name}/reference",
                *REFERENCE_MESSAGES[target.quantity],
                self._listener(target),
                stream=target.name,
                ordered=True,
            )
            for target in self._list
        )
        published = TopicOut(
            "references", "solfer/TaskReferences", TaskReferences, collect=self.task_references, rate=20.0
        )
        return (*received, published)

    def actions(self) -> tuple[Action, ...]:
        """Offer the action `reach`."""
        parts = (ReachGoal, ReachFeedback, ReachResult)
        return (
            Action(
                "reach",
                "solfer/Reach",
                *parts,
                begin=self._begin,
                outcome=self._outcome,
                report=lambda: self._reached(ReachFeedback),
                cancel=self._cancel,
            ),
        )

    def set_reference(self, request: SetReference) -> Accepted:
        """Carry out a request; nothing changes if a part of it is wrong.

        Raises:
            UnknownName: There is no such task.
            SizeMismatch, NotFinite: Its numbers do not fit.
        """
        self.target(request.task).request(request.values, request.relative)
        return Accepted()

    def get_reference(self, request: GetReference) -> ReferenceReply:
        """Return where the reference of a task is to be, and why the task has come to rest away from it.

        Raises:
            UnknownName: There is no such task.
        """
        target = self.target(request.task)
        return ReferenceReply(message=target.reason if target.is_unreachable else "", values=target.desired)

    def move_point(self, request: MovePoint) -> Accepted:
        """Add to the desired position of a task.

        Raises:
            UnknownName: There is no task of this number.
            NotFinite: A number is NaN or infinite.
        """
        numbered = [target for target in self._list if target.quantity != "orientation"]
        if not 0 <= request.nr < len(numbered):
            numbers = [f"{number} ({target.name})" for number, target in enumerate(numbered)]
            raise UnknownName("task with a position, number", str(request.nr), numbers)
        target = numbered[request.nr]
        shift = (request.x, request.y, request.z)
        target.request(shift if target.quantity == "position" else (*shift, 0.0, 0.0, 0.0, 1.0), relative=True)
        return Accepted()

    def target(self, name: str) -> TaskReference:
        """Return the task `name`; an UnknownName if others may give it no reference."""
        if name not in self._targets:
            raise UnknownName("task with a reference", name, self._targets)
        return self._targets[name]

    def task_references(self) -> TaskReferences:
        """Return the references of all tasks, as they are published."""
        return TaskReferences(
            *self._shown,
            tuple(pose_of(target.quantity, target.reference) for target in self._list),
            tuple(pose_of(target.quantity, target.desired) for target in self._list),
        )

    def _listener(self, target: TaskReference) -> Callable[[Any], None]:
        def listen(message: Any) -> None:
            target.check(message.numbers)
            target.check_frame(message.header.frame_id)
            target.request(message.numbers, stream=True)

        return listen

    def _begin(self, goal: ReachGoal) -> None:
        """Take over a goal of the action; nothing changes if a part of it is wrong."""
        if not goal.tasks or len(goal.poses) != len(goal.tasks):
            raise SizeMismatch(f"{len(goal.poses)} poses for {len(goal.tasks)} tasks", expected="one pose a task")
        targets = [self.target(name) for name in goal.tasks]
        desired = [target.part_of(numbers_of(pose)) for target, pose in zip(targets, goal.poses, strict=True)]
        for target, numbers in zip(targets, desired, strict=True):
            target.check(numbers)
        for target, numbers in zip(targets, desired, strict=True):
            target.request(numbers)
        self._reaching = tuple(targets)

    def _outcome(self) -> Outcome | None:
        if all(target.has_arrived() for target in self._reaching):
            return Outcome(self._reached(ReachResult), True, "reached")
        if all(target.has_arrived() or target.is_unreachable for target in self._reaching):
            reasons = [f"{target.name} {target.reason}" for target in self._reaching if target.is_unreachable]
            return Outcome(self._reached(ReachResult), False, ". ".join(reasons))
        return None

    def _reached(self, kind: type[ReachFeedback]) -> ReachFeedback:
        distances, angles = zip(*(target.remaining() for target in self._reaching), strict=True)
        return kind(distances, angles)

    def _cancel(self) -> None:
        for target in self._reaching:
            target.halt()
        self._reaching = ()


Names = tuple[str, ...]


def _shown(record: TaskLevelsRecord, targets: dict[str, TaskReference]) -> tuple[Names, Names, Names, Names]:
    """Return names, quantities, frames and links of references, as they are published."""
    records = [record_of(record, name) for name in targets]
    return (
        tuple(targets),
        tuple(target.quantity for target in targets.values()),
        # others know no frame with the origin of one and the axes of another
        tuple("" if each.axes == "world" and each.relative else each.relative or WORLD for each in records),
        tuple(
            str(each.link or "") if name in record.tasks else name.rpartition("/")[2]
            for name, each in zip(targets, records, strict=True)
        ),
    )


def record_of(record: TaskLevelsRecord, name: str) -> TaskRecord:
    """Return the record of a task, which may be one of several links."""
    tasks: Any = record.tasks
    found: TaskRecord = tasks[name] if name in tasks else tasks[name.rpartition("/")[0]]
    return found
