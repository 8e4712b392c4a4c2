"""What components share whose tasks follow references of others."""

import abc
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.following.generated import GeneratedPosture, require_speeds
from solfer.components.following.quantity import quantity_of
from solfer.components.following.tags import FollowingTags, MotionRecord
from solfer.components.following.target import WORLD, Target
from solfer.config.records.live import is_live
from solfer.config.tasks.references import ReferenceRecord
from solfer.config.tasks.stack import TaskLevelsRecord, TaskRecord
from solfer.errors import SizeMismatch, SolferError, UnknownName, raise_all
from solfer.interfaces.declaration import Accepted, Action, LiveParameter, Outcome, Service, TopicIn, TopicOut
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
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import ReferenceFilter
from solfer.points import Constant
from solfer.references import ReferenceGenerator, build_reference
from solfer.robot import Robot
from solfer.tasks import Task
from solfer.tasks.building.build import ConfiguredTasks
from solfer.throttle import Throttle

log = logging.getLogger(__name__)

FOLLOWING = ("position", "orientation", "pose", "center_of_mass", "look_at")
"""What others may give references to: tasks on these points."""

REFERENCE_RATE = 20.0
"""Messages with references in a second [Hz]."""


class ReferenceFollower(Component, abc.ABC):
    """A component whose tasks follow references.

    Each task on a position, an orientation or a pose has a reference that others set: by a Point pipe of the task's
    name, a topic, a service, or the action `reach`. Until then it may follow one that the configuration generates.
    `tags` are `FollowingTags`. A subclass calls `_follow` when it is made, `_connect` in `set_rate`,
    `_start_references` in `init`, and in `update` `_advance`, `_prepare` and `_judge`.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        targets: Tasks that others may give references to, by name.
    """

    targets: dict[str, Target]

    def __init__(self, robot: Robot, tags: Any, name: str):
        super().__init__(robot, tags, name)
        self._throttle = Throttle(log)
        # of what is absolute the first way is known at the start
        self._checks: list[Callable[[], None]] = []
        self._reaching: tuple[Target, ...] = ()

    def reset(self) -> None:
        """Forget what was desired."""
        self._reaching = ()

    def services(self) -> tuple[Service, ...]:
        """Offer `reference`, `get_reference`, and `ub_reference` as the original has it."""
        return (
            Service("reference", "solfer/SetReference", SetReference, reply=Accepted, handler=self.set_reference),
            Service(
                "get_reference", "solfer/GetReference", GetReference, reply=ReferenceReply, handler=self.get_reference
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
            "references", "solfer/TaskReferences", TaskReferences, collect=self._references_now_and_then
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
                report=self._report,
                cancel=self._cancel,
            ),
        )

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer how references move, and when a task has arrived."""
        motions = [("motion",), *(("motions", name) for name in self.tags.motions)]
        keys = [key for key, field in MotionRecord.model_fields.items() if is_live(field)]
        return (
            *(LiveParameter((*motion, key), self._take_motions) for motion in motions for key in keys),
            *(LiveParameter((key,), self._take_tolerances) for key in ("tolerance", "turn_tolerance")),
        )

    def set_reference(self, request: SetReference) -> Accepted:
        """Carry out a request; nothing changes if a part of it is wrong.

        Raises:
            UnknownName: There is no such task.
            SizeMismatch, NotFinite: Its numbers do not fit.
        """
        self.target(request.task).want(request.values, request.relative)
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
        if not 0 <= request.nr < len(self._numbered):
            numbers = [f"{number} ({target.name})" for number, target in enumerate(self._numbered)]
            raise UnknownName("task with a position, number", str(request.nr), numbers)
        target = self._numbered[request.nr]
        shift = (request.x, request.y, request.z)
        target.want(shift if target.quantity == "position" else (*shift, 0.0, 0.0, 0.0, 1.0), relative=True)
        return Accepted()

    def target(self, name: str) -> Target:
        """Return the task `name`; an UnknownName if others may give it no reference."""
        if name not in self.targets:
            raise UnknownName("task with a reference", name, self.targets)
        return self.targets[name]

    def task_references(self) -> TaskReferences:
        """Return the references of all tasks, as they are published."""
        return TaskReferences(
            *self._shown,
            tuple(pose_of(target.quantity, target.reference) for target in self._list),
            tuple(pose_of(target.quantity, target.desired) for target in self._list),
        )

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`."""
        for target in self._list:
            target.displace(move)

    def log_references(self, logger: Any) -> None:
        """Declare references and residuals."""
        names = [target.name for target in self._list]
        axes = ("x", "y", "z", "qx", "qy", "qz", "qw")
        logger.add("reference", self._filter.value, [f"{name}.{axis}" for name in names for axis in axes])
        logger.add("residual", self._residuals, [f"{name}.{part}" for name in names for part in ("distance", "angle")])

    def _follow(self, record: TaskLevelsRecord, stack: ConfiguredTasks, speeds: np.ndarray) -> None:
        """Let tasks have references.

        Args:
            record: The tasks' configuration.
            stack: The tasks.
            speeds: Largest speeds of all DoFs, of postures, shape (n,) [rad/s, m/s].

        Raises:
            SolferError: A reference does not fit its task, or is too fast; SolferErrors: several do not.
        """
        self.targets = {}
        postures: list[GeneratedPosture] = []
        errors: list[SolferError] = []
        for name, reference in stack.references.items():
            task = record_of(record, name)
            try:
                if task.point in FOLLOWING:
                    generator = self._generator(name, task, reference)
                    frame = task.relative or WORLD
                    self.targets[name] = Target(name, stack.tasks[name], reference, frame=frame, generator=generator)
                elif task.point == "posture" and isinstance(task.reference, ReferenceRecord):
                    postures.append(GeneratedPosture(stack.tasks[name], reference, task, limits=speeds))
            except SolferError as error:
                errors.append(error)
        raise_all(errors)
        for name in self.tags.motions:
            if name not in self.targets:
                raise UnknownName("task with a reference", name, self.targets, where=self.tags.where("motions", name))
        self._postures = tuple(postures)
        self.inputs |= {name: target.port for name, target in self.targets.items()}
        self._list = tuple(self.targets.values())
        self._numbered = tuple(target for target in self._list if target.quantity != "orientation")
        records = [record_of(record, name) for name in self.targets]
        self._shown = (
            tuple(self.targets),
            tuple(target.quantity for target in self._list),
            # others know no frame with the origin of one and the axes of another
            tuple("" if each.axes == "world" and each.relative else each.relative or WORLD for each in records),
            tuple(
                str(each.link or "") if name in record.tasks else name.rpartition("/")[2]
                for name, each in zip(self.targets, records, strict=True)
            ),
        )

    def _generator(self, name: str, task: TaskRecord, reference: Constant) -> ReferenceGenerator | None:
        if not isinstance(task.reference, ReferenceRecord):
            return None
        generator = build_reference(task.reference, quantity_of(reference))
        # periods are for the tags of the original alone, whose tasks have no reference of their own
        check = partial(require_speeds, generator, task.reference, self.tags.motion_of(name, math.inf))
        check()
        if task.reference.absolute:
            self._checks.append(check)
        return generator

    def _connect(self) -> None:
        """Let references move as configured, at the rate that is known now."""
        tags = self.tags
        self._filter = ReferenceFilter(len(self._list), self.period)
        self._residuals = np.zeros((len(self._list), 2))
        self._countdown = self._interval = max(round(1.0 / (self.period * REFERENCE_RATE)), 1)
        tolerances = np.array((tags.tolerance, tags.turn_tolerance))
        for index, target in enumerate(self._list):
            target.connect(
                self._filter, index, tags.motion_of(target.name, self.period), tolerances, self._residuals[index]
            )
        self._tolerances = tolerances

    def _task_parameters(self, stack: ConfiguredTasks, keys: Sequence[str]) -> Iterator[LiveParameter]:
        """Yield the numbers of all tasks of `stack`, for the keys of their records."""
        for name, record in self.tags.stack.tasks.items():
            for key in keys:
                if key == "gain" and record.is_motion:
                    continue  # its error says nothing
                numbers = partial(_numbers, stack, name, key)
                yield LiveParameter(
                    ("stack", "tasks", name, key), partial(self._take_numbers, stack, name, key), numbers
                )

    def _take_numbers(self, stack: ConfiguredTasks, name: str, key: str, numbers: np.ndarray) -> None:
        """Write the numbers of all rows of the tasks of a record."""
        first = 0
        for task in stack.members(name):
            self._take_number(task, key, numbers[first : first + task.rows])
            first += task.rows

    def _take_number(self, task: Task, key: str, numbers: np.ndarray) -> None:
        """Write the numbers of a task; shape (rows,)."""
        target = self.targets.get(task.name)
        if key == "correction" and target is not None:
            target.correct(numbers)
            target.limit(self.tags.motion_of(task.name, self.period))
            return
        getattr(task, key)[:] = numbers
        if key == "gain" and target is not None:
            target.take_gain()

    def _take_motions(self, tags: FollowingTags) -> None:
        for target in self._list:
            target.limit(tags.motion_of(target.name, self.period))

    def _take_tolerances(self, tags: FollowingTags) -> None:
        self._tolerances[:] = tags.tolerance, tags.turn_tolerance

    def _start_references(self) -> None:
        """Begin where the points are, at rest.

        Raises:
            ComponentError: The way to the first value of a generated reference is too fast.
        """
        for target in self._list:
            target.start()
        for posture in self._postures:
            posture.start()
        for check in self._checks:
            check()
        self._reaching = ()

    def _references_now_and_then(self) -> TaskReferences | None:
        self._countdown -= 1
        if self._countdown > 0:
            return None
        self._countdown = self._interval
        return self.task_references()

    def _advance(self, step: float) -> None:
        """Read what the ports have received, and let references go on by `step` [s]."""
        self._filter.period = step * self.pace
        for target in self._list:
            if target.port.fresh:
                self._read(target)
            target.refer()
            if self.pace:
                target.generate(step * self.pace)
        for posture in self._postures:
            posture.update(step, self.pace)
        if self.pace:
            self._filter.update()

    def _prepare(self) -> None:
        """Write what the tasks follow in this cycle, after `_advance`."""
        for target in self._list:
            target.prepare(self.pace)

    @abc.abstractmethod
    def _obstacles(self, task: Task) -> str:
        """Return what keeps a task away from its reference."""

    def _judge(self) -> None:
        """Report what cannot be reached, the farthest task first: as long as it moves, it may pull others away."""
        farthest = None
        distance = 0.0
        for target in self._list:
            target.watch()
            if not target.is_still:
                return
            if not target.is_unreachable and target.distance > distance:
                farthest = target
                distance = target.distance
        if farthest is None or not farthest.stays:
            return
        gap = farthest.judge()
        if gap:
            reason = self._obstacles(farthest.task)
            farthest.reason = f"cannot be reached: it stays {gap} from its reference; {reason}"
            log.warning("%s: %s %s", self.name, farthest.where, farthest.reason)
        if farthest.is_unreachable:
            # what it has pulled away may come back now
            for target in self._list:
                target.refresh()

    def _read(self, target: Target) -> None:
        wrong = target.read_port()
        if wrong:
            self._throttle.warning(target.name, "%s: %s: %s is ignored", self.name, target.where, wrong)

    def _listener(self, target: Target) -> Callable[[Any], None]:
        def listen(message: Any) -> None:
            target.check(message.numbers)
            target.check_frame(message.header.frame_id)
            target.want(message.numbers, stream=True)

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
            target.want(numbers)
        self._reaching = tuple(targets)

    def _outcome(self) -> Outcome | None:
        if all(target.has_arrived() for target in self._reaching):
            return Outcome(self._reached(ReachResult), True, "reached")
        if all(target.has_arrived() or target.is_unreachable for target in self._reaching):
            reasons = [f"{target.name} {target.reason}" for target in self._reaching if target.is_unreachable]
            return Outcome(self._reached(ReachResult), False, ". ".join(reasons))
        return None

    def _report(self) -> ReachFeedback:
        return self._reached(ReachFeedback)

    def _reached(self, kind: type[ReachFeedback]) -> ReachFeedback:
        distances, angles = zip(*(target.remaining() for target in self._reaching), strict=True)
        return kind(distances, angles)

    def _cancel(self) -> None:
        for target in self._reaching:
            target.halt()
        self._reaching = ()


def _numbers(stack: ConfiguredTasks, name: str, key: str, tags: Any) -> np.ndarray:
    return stack.numbers(name, tags.stack.tasks[name], key)


def record_of(record: TaskLevelsRecord, name: str) -> TaskRecord:
    """Return the record of a task, which may be one of several links."""
    tasks: Any = record.tasks
    found: TaskRecord = tasks[name] if name in tasks else tasks[name.rpartition("/")[0]]
    return found
