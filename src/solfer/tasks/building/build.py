"""From the record of a stack of tasks to the stack."""

from collections.abc import Iterator, Mapping

import numpy as np

from solfer.config.tasks.references import ReferenceRecord
from solfer.config.tasks.stack import StackRecord, TaskLevelsRecord, TaskRecord
from solfer.errors import ConfigError, SizeMismatch, SolferError, TaskError, UnknownName, raise_all
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.points import Constant, LookAt, Point, Posture, vector
from solfer.points.offset import chosen
from solfer.robot import Robot
from solfer.tasks.building.limits import LimitMaker
from solfer.tasks.building.placed import Faults
from solfer.tasks.building.points import PointMaker, ahead
from solfer.tasks.hierarchy import Hierarchy
from solfer.tasks.qp_hierarchy import QpHierarchy
from solfer.tasks.task import Task


class ConfiguredTasks:
    """Tasks of a configuration, with their references.

    Args:
        record: The configuration.
        robot: The Robot.
        points: Points of the component that the configuration may name.

    Attributes:
        tasks: Tasks by name; those of several links are `NAME/LINK`.
        levels: The levels of tasks.
        references: The Constant that each task follows, by name of the task: that of a `look_at` is its target. A task
            that follows another point of the component has none.

    Raises:
        SolferError: Something that the configuration names is missing, or does not fit the robot.
        SolferErrors: Several of these.
    """

    def __init__(self, record: TaskLevelsRecord, robot: Robot, points: Mapping[str, Point]):
        self._record = record
        self._robot = robot
        self._faults = Faults()
        self._maker = PointMaker(robot, record.frames, points)
        self.tasks: dict[str, Task] = {}
        self.references: dict[str, Constant] = {}
        self._held: list[tuple[str, TaskRecord]] = []
        self._members: dict[str, list[Task]] = {}
        for name, task in record.tasks.items():
            self._members[name] = list(self._made(name, task))
        self.levels = self._levels()
        self._make_limits()
        raise_all(self._faults.errors)

    def start(self) -> None:
        """Make where the points are the reference of all tasks without one; the Robot and its points are updated."""
        for name, record in self._held:
            task = self.tasks[name]
            reference = self.references[name]
            if isinstance(task.point, LookAt):
                reference.set(ahead(task.point.frame, record))
            else:
                task.point.update()
                reference.set(task.point.value)

    def confine(self, dofs: np.ndarray) -> None:
        """Let tasks move no other DoFs than these, shape (m,); before what solves them is made."""
        for task in self.tasks.values():
            task.mask[np.setdiff1d(np.arange(self._robot.size), dofs)] = 0.0

    def members(self, name: str) -> tuple[Task, ...]:
        """Return the tasks of the record `name`: one, or one a link."""
        return tuple(self._members[name])

    def numbers(self, name: str, record: TaskRecord, key: str) -> np.ndarray:
        """Return the `gain`, `weight`, `damping` or `correction` of all rows of a record's tasks; changes nothing.

        Args:
            name: Name of the record.
            record: The record, which may have other numbers than the one that the tasks were made of.
            key: Which numbers.

        Raises:
            SizeMismatch: There is neither one number nor one a row.
            TaskError: A task whose error says nothing has a gain.
        """
        value = _number_of(record, key)
        if key == "gain" and record.is_motion and np.any(value):
            raise _no_gain(record, self._members[name][0].where)
        return self.rows(name, value)

    def rows(self, name: str, value: float | tuple[float, ...]) -> np.ndarray:
        """Return numbers of all rows of a record's tasks, of one number or one a row; a SizeMismatch for others."""
        tasks = self._members[name]
        parts = [_part_of(value, task.rows, place, count=len(tasks)) for place, task in enumerate(tasks)]
        for task, part in zip(tasks, parts, strict=True):
            if np.shape(part) not in ((), (task.rows,)):
                raise SizeMismatch(f"{np.size(part)} numbers for {task.rows} rows", expected="one number, or one a row")
        return np.concatenate([np.full(task.rows, part) for task, part in zip(tasks, parts, strict=True)])

    def _make_limits(self) -> None:
        """Make the limits of a stack that has some."""

    def _made(self, name: str, record: TaskRecord) -> Iterator[Task]:
        """Make the tasks of a record: one, or one a link."""
        faults = self._faults
        dofs = None
        with faults.at(record, "dofs" if record.without is None else "without"):
            dofs = self._dofs(record)
        links: list[tuple[int, str]] = []
        for index, link in enumerate(record.links):
            with faults.at(record, *_path_of_link(record, index)):
                links += [(index, each) for each in self._maker.expand(link)]
        several = not isinstance(record.link, str | None) or not all(map(self._maker.is_single, record.links))
        for place, (index, link) in enumerate(links or ([] if record.links else [(0, "")])):
            whole = f"{name}/{link}" if several else name
            before = len(faults.errors)
            with faults.at(record, *_path_of_link(record, index)):
                point = self._point(record, link, dofs)
            if len(faults.errors) > before:
                continue
            task = self._task(whole, record, point, dofs=dofs, place=place, count=len(links))
            if task is not None:
                self.tasks[whole] = task
                yield task

    def _point(self, record: TaskRecord, link: str, dofs: np.ndarray | None) -> Point:
        try:
            return self._maker.of(record, link, dofs)
        except SolferError as error:
            for key in ("point", "relative", "target"):
                if isinstance(error, UnknownName) and error.name == getattr(record, key):
                    error.where = record.where(key)
            raise

    def _task(
        self, name: str, record: TaskRecord, point: Point, dofs: np.ndarray | None, place: int, *, count: int
    ) -> Task | None:
        """Make the task number `place` of `count` of a record; None if there is a mistake."""
        faults = self._faults
        before = len(self._faults.errors)
        reference = None
        rows = None
        task = None
        with faults.at(record, "reference"):
            reference = self._reference(record, point)
        with faults.at(record, "rows"):
            rows = _rows(record, point)
        if len(faults.errors) > before:
            return None
        with faults.at(record):
            mask = None if isinstance(point, Posture) or dofs is None else dofs.tolist()
            task = Task(name, point, 0.0, reference=reference, rows=rows, dofs=mask)
        if task is None:
            return None
        for key in ("velocity", "weight", "damping", "gain", "correction"):
            with faults.at(record, key):
                setattr(task, key, _part_of(_number_of(record, key), task.rows, place, count=count))
        if record.is_motion and np.any(task.gain):
            with faults.at(record, "gain"):
                raise _no_gain(record, task.where)
        self._keep_reference(name, record, task)
        return task

    def _keep_reference(self, name: str, record: TaskRecord, task: Task) -> None:
        if isinstance(task.point, LookAt):
            if isinstance(task.point.target, Constant):
                self.references[name] = task.point.target
                if record.target is None:
                    self._held.append((name, record))
        elif isinstance(task.reference, Constant):
            self.references[name] = task.reference
            if record.is_held and not record.is_motion:
                self._held.append((name, record))

    def _reference(self, record: TaskRecord, point: Point) -> Point | np.ndarray | None:
        if isinstance(point, LookAt):
            if record.reference is not None:
                raise ConfigError("a task on 'look_at' has no reference", expected="a target")
            axis = np.array(record.axis or (1.0, 0.0, 0.0))
            return Constant(axis / np.linalg.norm(axis), vector(3))
        if isinstance(record.reference, str):
            if isinstance(point, Posture):
                return self._posture(record.reference, point)
            return self._maker.constant(record.reference, "point of the component")
        if record.reference is None or isinstance(record.reference, ReferenceRecord):
            return None
        return Constant(record.reference, point.space)

    def _posture(self, state: str, point: Posture) -> Constant:
        """Return a named state; joints that it does not name stay where they are."""
        dofs, values = self._robot.named_state(state)
        whole = self._robot.state.position.copy()
        whole[dofs] = values
        return Constant(whole[point.dofs])

    def _dofs(self, record: TaskRecord) -> np.ndarray | None:
        """Return the DoFs that move a task, shape (m,); None for the default."""
        if record.dofs is None and record.without is None:
            return None
        chosen = np.arange(self._robot.size) if record.dofs is None else self._named(record, "dofs")
        if record.dofs is None and record.point == "posture" and self._robot.kinematics.base is not None:
            chosen = chosen[6:]
        left = np.setdiff1d(chosen, np.zeros(0, int) if record.without is None else self._named(record, "without"))
        if not len(left):
            raise ConfigError("no DoF is left", expected="at least one DoF that moves the task")
        return left

    def _named(self, record: TaskRecord, key: str) -> np.ndarray:
        """Return the indices of DoFs and groups."""
        found: list[int] = []
        for index, name in enumerate(getattr(record, key)):
            if name in self._robot.dofs:
                found.append(self._robot.dof(name))
            elif name in self._robot.selectors:
                found += self._robot.selectors[name].indices.tolist()
            else:
                known = (*self._robot.dofs, *self._robot.selectors)
                raise UnknownName("DoF or group", name, known, where=record.where(key, index))
        return np.unique(found).astype(np.int64)

    def _levels(self) -> list[list[Task]]:
        used = set[str]()
        before = len(self._faults.errors)
        levels: list[list[Task]] = []
        for index, names in enumerate(self._record.levels):
            levels.append([])
            for place, name in enumerate(names):
                with self._faults.at(self._record, "levels", index, place):
                    if name not in self._members:
                        raise UnknownName("task", name, self._members)
                    if name in used:
                        raise ConfigError(f"task '{name}' is listed twice", expected="each task once")
                    used.add(name)
                    levels[-1] += self._members[name]
        has_unknown = len(self._faults.errors) > before
        for name in self._members:
            with self._faults.at(self._record.tasks[name]):
                if name not in used and not has_unknown:
                    raise ConfigError(f"task '{name}' is in no level", expected="each task in one of `levels`")
        return levels


class ConfiguredStack(ConfiguredTasks):
    """Tasks of a configuration with their limits, and what solves them; `build_stack` makes it.

    Args:
        record: The configuration.
        robot: The Robot.
        points: Points of the component that the configuration may name.

    Raises:
        SolferError: Something that the configuration names is missing, or does not fit the robot.
        SolferErrors: Several of these.
    """

    def __init__(self, record: StackRecord, robot: Robot, points: Mapping[str, Point]):
        self._stack_record = record
        super().__init__(record, robot, points)

    def confine(self, dofs: np.ndarray) -> None:
        """Let tasks and limits move no other DoFs than these, shape (m,); before the solver is made."""
        super().confine(dofs)
        self._limits.confine(dofs)

    def scale_speeds(self, ratio: float) -> None:
        """Let joints move with a ratio of their largest speeds; one number a change, no allocation of memory."""
        self._limits.scale_speeds(ratio)

    def keep_apart(self, distance: float) -> None:
        """Set the least distance of links that may touch [m]."""
        self._limits.keep_apart(distance)

    def bounds(self, period: float) -> VelocityBounds:
        """Make the bounds of the joint velocities for a control cycle of `period` [s]."""
        return self._limits.bounds(period)

    def solver(self, period: float, position: np.ndarray | None = None) -> Hierarchy | QpHierarchy:
        """Make the solver of all levels.

        Args:
            period: Period of the control cycle [s].
            position: Positions that limits are for, live, shape (n,); default: the measured ones.

        Raises:
            SolferError: A limit does not fit the robot or the period.
        """
        if self._stack_record.solver == "null_spaces":
            return Hierarchy(self.levels)
        return QpHierarchy(
            self.levels,
            self.bounds(period),
            self._limits.constraints(period),
            policy=self._stack_record.policy,
            position=position,
            relax=self._stack_record.relax,
        )

    def _make_limits(self) -> None:
        """See `ConfiguredTasks._make_limits`."""
        self._limits = LimitMaker(self._robot, self._stack_record, self._maker, faults=self._faults)


def build_stack(record: StackRecord, robot: Robot, points: Mapping[str, Point] | None = None) -> ConfiguredStack:
    """Build the stack of a configuration.

    Args:
        record: The configuration.
        robot: The Robot.
        points: Points of the component that the configuration may name, as what a task moves, as a reference or target,
            and, if they are poses, as links.

    Raises:
        SolferError: Something that the configuration names is missing, or does not fit the robot.
        SolferErrors: Several of these.
    """
    return ConfiguredStack(record, robot, points or {})


def _number_of(record: TaskRecord, key: str) -> float | tuple[float, ...]:
    """Return the numbers of a key, also where they are left out."""
    value: float | tuple[float, ...] | None = getattr(record, key)
    if value is not None:
        return value
    return np.inf if key == "correction" else 0.0 if record.is_motion else 1.0


def _no_gain(record: TaskRecord, where: str) -> TaskError:
    what = f"a gain of a task on '{record.point}', whose error says nothing"
    return TaskError(what, where=where, expected="a velocity instead")


def _path_of_link(record: TaskRecord, index: int) -> tuple[str | int, ...]:
    if record.link is None:
        return ("point",)
    return ("link",) if isinstance(record.link, str) else ("link", index)


def _part_of(values: float | tuple[float, ...], rows: int, place: int, count: int) -> float | tuple[float, ...]:
    """Return the numbers of one of several tasks, where there is one for each row of all of them."""
    if isinstance(values, tuple) and count > 1 and len(values) == rows * count:
        return values[rows * place : rows * (place + 1)]
    return values


def _rows(record: TaskRecord, point: Point) -> list[int] | None:
    """Return the numbers of the rows that count, which may have names."""
    if record.rows is None:
        return [5] if record.point == "steering" else None
    names: tuple[str, ...] = ()
    if record.point in ("orientation", "angular_momentum"):
        names = ("rx", "ry", "rz")
    elif not isinstance(point, Posture) and point.rows in (3, 6):
        names = ("x", "y", "z", "rx", "ry", "rz")[: point.rows]
    found = []
    for index, row in enumerate(record.rows):
        if isinstance(row, str) and row not in names:
            known = names or [str(number) for number in range(point.rows)]
            raise UnknownName("row", row, known, where=record.where("rows", index))
        found.append(names.index(row) if isinstance(row, str) else row)
    return chosen("row", found, point.rows, names=(), where=f"task on '{record.point}'", error=TaskError).tolist()
