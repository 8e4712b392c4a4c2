"""References of tasks, which others set or the configuration generates."""

import logging
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from solfer.components.following.generated import GeneratedPosture, require_speeds
from solfer.components.following.progress import CHECK_PERIOD
from solfer.components.following.quantity import quantity_of
from solfer.components.following.reference_interface import ReferenceInterface, record_of
from solfer.components.following.tags import FollowingTags, MotionRecord
from solfer.components.following.task_reference import WORLD, TaskReference
from solfer.config.records.live import is_live
from solfer.config.tasks.references import ReferenceRecord
from solfer.config.tasks.stack import TaskLevelsRecord, TaskRecord
from solfer.errors import SolferError, UnknownName, raise_all
from solfer.interfaces.declaration import LiveParameter
from solfer.interfaces.port import Port
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import ReferenceFilter
from solfer.points import Constant
from solfer.references import ReferenceGenerator, build_reference
from solfer.tasks import Task
from solfer.tasks.building.build import ConfiguredTasks
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class ReferenceSet:
    """References of all tasks of a component, which composes them.

    Each task on a position, an orientation or a pose has a reference that others set: by a Point pipe of the task's
    name, a topic, a service, or the action `reach`. Until then it may follow one that the configuration generates.

    A component calls `connect` when its rate is known, and `start` when it starts. In a cycle it calls `update` before
    it computes its tasks, which writes what they follow, and `report` after that.

    Args:
        component: Name of the component, for messages.
        tags: Tags of the component, `FollowingTags`.
        record: The tasks' configuration.
        stack: The tasks.
        speeds: Largest speeds of all DoFs, of postures, shape (n,) [rad/s, m/s].
        obstacles: Returns what keeps a task away from its reference.
        holds: Whether tasks that have come to rest away from their references stay there, until a reference moves: what
            they request would only turn arms slowly, in directions that bring them no nearer.

    Attributes:
        targets: Tasks that others may give references to, by name.
        list: The same in the order of the configuration.
        interface: How others set and read them.

    Raises:
        SolferError: A reference does not fit its task, or is too fast; SolferErrors: several do not.
    """

    def __init__(
        self,
        component: str,
        tags: Any,
        record: TaskLevelsRecord,
        stack: ConfiguredTasks,
        speeds: np.ndarray,
        *,
        obstacles: Callable[[Task], str],
        holds: bool = False,
    ):
        self._component = component
        self._tags = tags
        self._obstacles = obstacles
        self._holds = holds
        self._throttle = Throttle(log)
        # of what is absolute the first way is known at the start
        self._checks: list[Callable[[], None]] = []
        self._postures: tuple[GeneratedPosture, ...]
        self.targets, self._postures = self._make(record, stack, speeds)
        self.list = tuple(self.targets.values())
        self.interface = ReferenceInterface(self.targets, record)

    @property
    def inputs(self) -> dict[str, Port]:
        """Ports of the references, by name."""
        return {name: target.port for name, target in self.targets.items()}

    def reset(self) -> None:
        """Forget what was requested."""
        self.interface.reset()

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer how references move, and when a task has arrived."""
        motions = [("motion",), *(("motions", name) for name in self._tags.motions)]
        keys = [key for key, field in MotionRecord.model_fields.items() if is_live(field)]
        return (
            *(LiveParameter((*motion, key), self._take_motions) for motion in motions for key in keys),
            *(LiveParameter((key,), self._take_tolerances) for key in ("tolerance", "turn_tolerance")),
        )

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`."""
        for target in self.list:
            target.displace(move)

    def log_references(self, logger: Any) -> None:
        """Declare references and residuals."""
        names = [target.name for target in self.list]
        axes = ("x", "y", "z", "qx", "qy", "qz", "qw")
        logger.add("reference", self._filter.value, [f"{name}.{axis}" for name in names for axis in axes])
        logger.add("residual", self._residuals, [f"{name}.{part}" for name in names for part in ("distance", "angle")])

    def _make(
        self, record: TaskLevelsRecord, stack: ConfiguredTasks, speeds: np.ndarray
    ) -> tuple[dict[str, TaskReference], tuple[GeneratedPosture, ...]]:
        """Make the references of tasks on poses, and those of postures."""
        targets: dict[str, TaskReference] = {}
        postures: list[GeneratedPosture] = []
        errors: list[SolferError] = []
        following = ("position", "orientation", "pose", "center_of_mass", "look_at")  # points that references may move
        for name, reference in stack.references.items():
            task = record_of(record, name)
            try:
                if task.point in following:
                    generator = self._generator(name, task, reference)
                    frame = task.relative or WORLD
                    targets[name] = TaskReference(name, stack.tasks[name], reference, frame=frame, generator=generator)
                elif task.point == "posture" and isinstance(task.reference, ReferenceRecord):
                    postures.append(GeneratedPosture(stack.tasks[name], reference, task, limits=speeds))
            except SolferError as error:
                errors.append(error)
        raise_all(errors)
        for name in self._tags.motions:
            if name not in targets:
                raise UnknownName("task with a reference", name, targets, where=self._tags.where("motions", name))
        return targets, tuple(postures)

    def _generator(self, name: str, task: TaskRecord, reference: Constant) -> ReferenceGenerator | None:
        if not isinstance(task.reference, ReferenceRecord):
            return None
        generator = build_reference(task.reference, quantity_of(reference))
        # periods are for the tags of the original alone, whose tasks have no reference of their own
        check = partial(require_speeds, generator, task.reference, self._tags.motion_of(name, math.inf))
        check()
        if task.reference.absolute:
            self._checks.append(check)
        return generator

    def connect(self, period: float) -> None:
        """Let references move as configured, in control cycles of `period` [s]."""
        tags = self._tags
        self._period = period
        self._left = 0
        self._filter = ReferenceFilter(len(self.list), period)
        self._residuals = np.zeros((len(self.list), 2))
        tolerances = np.array((tags.tolerance, tags.turn_tolerance))
        for index, target in enumerate(self.list):
            target.connect(self._filter, index, tags.motion_of(target.name, period), tolerances, self._residuals[index])
        self._tolerances = tolerances

    def task_parameters(
        self, stack: ConfiguredTasks, keys: Sequence[str], take: Callable[[Task, str, np.ndarray], None]
    ) -> Iterator[LiveParameter]:
        """Yield the numbers of all tasks of `stack`, for the keys of their records.

        Args:
            stack: The tasks.
            keys: Keys of their records.
            take: Takes the numbers of a task over, shape (rows,), for a key; in the end it calls `take_number`.
        """
        for name, record in self._tags.stack.tasks.items():
            for key in keys:
                if key == "gain" and record.is_motion:
                    continue  # its error says nothing
                numbers = partial(_numbers, stack, name, key)
                write = partial(take_numbers, stack, name, take, key)
                yield LiveParameter(("stack", "tasks", name, key), write, numbers)

    def take_number(self, task: Task, key: str, numbers: np.ndarray) -> None:
        """Write the numbers of a task; shape (rows,)."""
        target = self.targets.get(task.name)
        if key == "correction" and target is not None:
            target.correct(numbers)
            target.limit(self._tags.motion_of(task.name, self._period))
            return
        getattr(task, key)[:] = numbers
        if key == "gain" and target is not None:
            target.take_gain()

    def _take_motions(self, tags: FollowingTags) -> None:
        self._tags = tags
        for target in self.list:
            target.limit(tags.motion_of(target.name, self._period))

    def _take_tolerances(self, tags: FollowingTags) -> None:
        self._tolerances[:] = tags.tolerance, tags.turn_tolerance

    def start(self) -> None:
        """Begin where the points are, at rest.

        Raises:
            ComponentError: The way to the first value of a generated reference is too fast.
        """
        for target in self.list:
            target.start()
        for posture in self._postures:
            posture.start()
        for check in self._checks:
            check()
        self.interface.reset()

    def update(self, step: float, pace: float) -> None:
        """Read what the ports have received, let references go on, and write what the tasks follow in this cycle.

        Args:
            step: Time that passes [s].
            pace: Ratio of their speed with which motions may go on.
        """
        self._filter.period = step * pace
        for target in self.list:
            if target.port.fresh and (wrong := target.read_port()):
                self._throttle.warning(target.name, "%s: %s: %s is ignored", self._component, target.where, wrong)
            target.refer()
            if pace and target.generated is not None:
                target.generate(step * pace)
        for posture in self._postures:
            posture.update(step, pace)
        if pace:
            self._filter.update()
        if self._holds:
            self._hold_what_stays_away()
        for target in self.list:
            target.prepare(pace)

    def report(self) -> None:
        """Log what cannot be reached, the farthest task first: as long as it moves, it may pull others away.

        Called in each cycle; it looks every CHECK_PERIOD.
        """
        self._left -= 1
        if self._left > 0:
            return
        self._left = round(CHECK_PERIOD / self._period)
        farthest = None
        distance = 0.0
        for target in self.list:
            if not target.watch():
                return
            if not target.is_unreachable and target.distance > distance:
                farthest = target
                distance = target.distance
        if farthest is None or not farthest.stays:
            return
        gap = farthest.come_to_rest()
        if gap:
            reason = self._obstacles(farthest.task)
            farthest.reason = f"cannot be reached: it stays {gap} from its reference; {reason}"
            log.warning("%s: %s %s", self._component, farthest.where, farthest.reason)
        if farthest.is_unreachable:
            # what it has pulled away may come back now
            for target in self.list:
                target.refresh()

    def _hold_what_stays_away(self) -> None:
        is_still = self._filter.all_still
        for target in self.list:
            if not is_still:
                target.follow()
            elif target.progress.is_unreachable:
                target.hold()


def take_numbers(
    stack: ConfiguredTasks, name: str, take: Callable[[Task, str, np.ndarray], None], key: str, numbers: np.ndarray
) -> None:
    """Let `take` write the numbers of a key for each task of a record, which are those of all their rows."""
    first = 0
    for task in stack.members(name):
        take(task, key, numbers[first : first + task.rows])
        first += task.rows


def _numbers(stack: ConfiguredTasks, name: str, key: str, tags: Any) -> np.ndarray:
    return stack.numbers(name, tags.stack.tasks[name], key)
