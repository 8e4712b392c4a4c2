"""The component `inverse_kinematics`."""

import logging
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.declaration import Accepted, Action, Outcome, Service, TopicIn
from solfer.components.inverse_kinematics.deflection import Deflection
from solfer.components.inverse_kinematics.generated import GeneratedPosture, require_speeds
from solfer.components.inverse_kinematics.obstacles import obstacles
from solfer.components.inverse_kinematics.requests import (
    MESSAGES,
    GetReference,
    MovePoint,
    ReachFeedback,
    ReachGoal,
    ReachResult,
    ReferenceReply,
    SetReference,
    numbers_of,
)
from solfer.components.inverse_kinematics.soft_level import SoftLevel
from solfer.components.inverse_kinematics.tags import DeflectionRecord, InverseKinematicsTags
from solfer.components.inverse_kinematics.target import WORLD, Target, quantity_of
from solfer.config.tasks.references import ReferenceRecord
from solfer.config.tasks.stack import StackRecord, TaskRecord
from solfer.errors import ComponentError, SizeMismatch, SolferError, UnknownName, raise_all
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import ReferenceFilter
from solfer.points import Constant
from solfer.references import ReferenceGenerator, build_reference
from solfer.robot import Robot
from solfer.tasks import ReferenceIntegrator
from solfer.tasks.building.build import build_stack
from solfer.throttle import Throttle

log = logging.getLogger(__name__)

FOLLOWING = ("position", "orientation", "pose", "center_of_mass", "look_at")
"""What others may give references to: tasks on these points."""


class InverseKinematics(Component):
    """Lets points of the robot follow references: hands, centre of mass, posture, in the order of priority.

    A stack of tasks gives joint velocities, whose integral is commanded, within the limits of the joints. Each task on
    a position, an orientation or a pose has a reference that others set: by a Point pipe of the task's name, a topic, a
    service, or the action `reach`. Until then it may follow one that the configuration generates.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        targets: Tasks that others may give references to, by name.

    Raises:
        SolferError: The stack names something that the robot does not have, or does not fit it.
        SolferErrors: Several of these.
    """

    Tags = InverseKinematicsTags

    def __init__(self, robot: Robot, tags: InverseKinematicsTags, name: str = "inverse_kinematics"):
        super().__init__(robot, tags, name)
        self._is_measured = tags.is_measured
        self._inner = robot if self._is_measured else robot.twin()
        record = tags.stack_record()
        self.kinematics = self._is_measured
        self.dynamics = self._is_measured and record.limits.torques is not None
        self._moved = self._movable()
        self._others = np.setdiff1d(np.arange(robot.size), self._moved)
        robot.update()
        self._set_out()
        self._stack = build_stack(record, self._inner)
        self._stack.confine(self._moved)
        # of what is absolute the first way is known at the start
        self._checks: list[Callable[[], None]] = []
        self.targets = self._make_targets(record)
        self._postures = self._make_postures(record)
        self.inputs |= {name: target.port for name, target in self.targets.items()}
        self._list = tuple(self.targets.values())
        self._numbered = tuple(target for target in self._list if target.quantity != "orientation")
        self._reaching: tuple[Target, ...] = ()
        self._length = tags.characteristic_length
        self._throttle = Throttle(log)
        self._has_torques = record.limits.torques is not None and not self._is_measured

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz], and make what depends on it; see `Component.set_rate`."""
        super().set_rate(rate)
        if self._is_measured and not self.kinematics:
            raise ComponentError(
                f"'{self.name}' without kinematics is closed on measurements", expected="kinematics: true"
            )
        inner, tags = self._inner, self.tags
        self._solver = self._stack.solver(self.period, inner.command.position)
        lead = np.inf if tags.lead is None else tags.lead
        self._bounds = self._stack.bounds(self.period)
        self._integrator = ReferenceIntegrator(inner, self.period, self._bounds, lead)
        self._filter = ReferenceFilter(len(self._list), self.period)
        self._deflection = None if tags.deflection is None else self._make_deflection(tags.deflection)
        tolerances = np.array((tags.tolerance, tags.turn_tolerance))
        for index, target in enumerate(self._list):
            motion = tags.motion_of(target.name, self.period)
            self._filter.limits[index] = motion.limits
            target.connect(self._filter, index, motion, tolerances)
        self._levels = tuple(
            SoftLevel(level, [target for target in self._list if target.task in level], self._length)
            for level in self._stack.levels
        )
        # what is logged
        self._residuals = np.zeros((len(self._list), 2))
        for row, target in zip(self._residuals, self._list, strict=True):
            target.residual = row

    def init(self) -> None:
        """Start from where the robot is, at rest: references of tasks without one are where their points are.

        Raises:
            ComponentError: The way to the first value of a generated reference is too fast.
        """
        command, inner = self.model.command, self._inner
        command.position[:], command.velocity[:] = self.start_position, 0.0
        self._set_out()
        self._integrator.start(self.start_position)
        if not self._is_measured:
            inner.state.position[:] = inner.command.position
        if self._deflection is not None:
            self._deflection.start(self.model.state.position, inner.command.position)
            inner.state.position += self._deflection.value
        self._inner.update()
        self._solver.stack.update()
        self._stack.start()
        self._solver.stack.update()
        for target in self._list:
            target.start()
        for posture in self._postures:
            posture.start()
        for check in self._checks:
            check()
        self._reaching = ()

    def update(self) -> None:
        """Compute one cycle."""
        step = self.time_step
        self._filter.period = step * self.pace
        self._integrator.set_period(step)
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
        self._hold_what_stays_away()
        for target in self._list:
            target.prepare(self.pace)
        if not self._is_measured:
            self._follow_model()
        self._integrator.update(self._solver.update())
        for level in self._levels:
            level.update()
        self._judge()

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`. A model that moves its base itself does not follow the measured one."""
        if self._is_measured or 0 not in self._moved:
            for target in self._list:
                target.displace(move)

    def send(self) -> None:
        """Write positions and velocities of the joints that it moves."""
        if self._is_measured:
            return
        command, inner = self.model.command, self._inner.command
        command.position[self._moved] = inner.position[self._moved]
        command.velocity[self._moved] = inner.velocity[self._moved]

    def reset(self) -> None:
        """Forget what was wanted."""
        self._reaching = ()

    def stop(self) -> None:
        """Hold the joints where they are wanted."""
        self._inner.command.velocity[:] = 0.0
        self.model.command.velocity[:] = 0.0

    def start_log(self, logger: Any) -> None:
        """Declare references, residuals, and the joints that are wanted."""
        names = [target.name for target in self._list]
        axes = ("x", "y", "z", "qx", "qy", "qz", "qw")
        add = logger.add
        add("reference", self._filter.value, [f"{name}.{axis}" for name in names for axis in axes])
        add("residual", self._residuals, [f"{name}.{part}" for name in names for part in ("distance", "angle")])
        add("velocity", self._solver.velocity, self.model.dofs)
        if self._deflection is not None:
            add("deflection", self._deflection.value, self.model.dofs)

    def services(self) -> tuple[Service, ...]:
        """Offer `reference`, `get_reference`, and `ub_reference` as the original has it."""
        return (
            Service("reference", "solfer/SetReference", SetReference, Accepted, self.set_reference),
            Service("get_reference", "solfer/GetReference", GetReference, ReferenceReply, self.get_reference),
            Service("ub_reference", "solfer/MovePoint", MovePoint, Accepted, self.move_point),
        )

    def topics(self) -> tuple[TopicIn, ...]:
        """Receive references of all tasks, each on a topic of its own: `<name>/<task>/reference`."""
        return tuple(
            TopicIn(f"{target.name}/reference", *MESSAGES[target.quantity], self._listener(target), stream=target.name)
            for target in self._list
        )

    def actions(self) -> tuple[Action, ...]:
        """Offer the action `reach`."""
        parts = (ReachGoal, ReachFeedback, ReachResult)
        return (Action("reach", "solfer/Reach", *parts, self._begin, self._outcome, self._report, self._cancel),)

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
        """Add to the wanted position of a task.

        Raises:
            UnknownName: There is no task of this number.
            NotFinite: A number is NaN or infinite.
        """
        if not 0 <= request.nr < len(self._numbered):
            numbers = [f"{number} ({target.name})" for number, target in enumerate(self._numbered)]
            raise UnknownName("task with a position, number", str(request.nr), numbers)
        target, shift = self._numbered[request.nr], (request.x, request.y, request.z)
        target.want(shift if target.quantity == "position" else (*shift, 0.0, 0.0, 0.0, 1.0), relative=True)
        return Accepted()

    def target(self, name: str) -> Target:
        """Return the task `name`; an UnknownName if others may give it no reference."""
        if name not in self.targets:
            raise UnknownName("task with a reference", name, self.targets)
        return self.targets[name]

    def _movable(self) -> np.ndarray:
        """Return the DoFs that it moves: driven joints of the chain, and the base if it belongs to it."""
        robot, chain = self.model, self.tags.chain
        base = np.arange(0 if robot.kinematics.base is None else 6)
        free = np.union1d(robot.actuated, base)
        if chain is None:
            return free
        try:
            return np.intersect1d(robot.selectors[chain].indices, free)
        except UnknownName as error:
            raise error.at(self.tags.where("chain")) from None

    def _set_out(self) -> None:
        """Let the model be where the robot is."""
        if not self._is_measured:
            self._inner.state.position[:] = self.model.state.position
        self._inner.update()

    def _make_targets(self, record: StackRecord) -> dict[str, Target]:
        targets: dict[str, Target] = {}
        errors: list[SolferError] = []
        for name, reference in self._stack.references.items():
            task = _record_of(record, name)
            if task.point in FOLLOWING:
                frame = task.relative or WORLD
                try:
                    generator = self._generator(name, task, reference)
                except SolferError as error:
                    errors.append(error)
                    continue
                targets[name] = Target(name, self._stack.tasks[name], reference, frame, generator)
        raise_all(errors)
        for name in self.tags.motions:
            if name not in targets:
                raise UnknownName("task with a reference", name, targets, where=self.tags.where("motions", name))
        return targets

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

    def _make_postures(self, record: StackRecord) -> tuple[GeneratedPosture, ...]:
        scale = record.limits.speed_scale
        limits = self.model.upper_limits.velocity * scale
        return tuple(
            GeneratedPosture(self._stack.tasks[name], reference, task, limits)
            for name, reference in self._stack.references.items()
            if (task := _record_of(record, name)).point == "posture" and isinstance(task.reference, ReferenceRecord)
        )

    def _make_deflection(self, record: DeflectionRecord) -> Deflection:
        base = 0 if self.model.kinematics.base is None else 6
        return Deflection(self.model.size, base, record.time_constant, record.most)

    def _read(self, target: Target) -> None:
        wrong = target.read_port()
        if wrong:
            self._throttle.warning(target.name, "%s: %s: %s is ignored", self.name, target.where, wrong)

    def _judge(self) -> None:
        """Say what cannot be reached, the farthest task first: as long as it moves, it may pull others away."""
        farthest, distance = None, 0.0
        for target in self._list:
            target.watch()
            if not target.is_still:
                return
            if not target.is_unreachable and target.distance > distance:
                farthest, distance = target, target.distance
        if farthest is None or not farthest.stays:
            return
        said = farthest.judge()
        if said:
            reason = obstacles(farthest.task, self._inner.command, self._bounds, self._moved)
            farthest.reason = f"cannot be reached: it stays {said} from its reference; {reason}"
            log.warning("%s: %s %s", self.name, farthest.where, farthest.reason)
        if farthest.is_unreachable:
            # what it has pulled away may come back now
            for target in self._list:
                target.look_anew()

    def _hold_what_stays_away(self) -> None:
        """Let tasks that have come to rest away from their references stay there, until a reference moves.

        What they still want would only turn arms slowly, in directions that bring them no nearer.
        """
        is_still = self._filter.all_still
        for target in self._list:
            if not is_still:
                target.let_go()
            elif target.is_unreachable and self._length:
                target.hold()

    def _follow_model(self) -> None:
        """Bring the model to the commanded positions, and what it does not move to the measured ones."""
        inner, measured = self._inner, self.model.state.position
        state, command = inner.state, inner.command
        command.position[self._others] = measured[self._others]
        state.position[:] = command.position
        if self._deflection is not None:
            self._deflection.update(measured, command.position, self.time_step)
            state.position += self._deflection.value
        state.velocity[:] = command.velocity
        inner.update()
        if self._has_torques:
            inner.dynamics.update()

    def _listener(self, target: Target) -> Callable[[Any], None]:
        def listen(message: Any) -> None:
            target.check(message.numbers)
            target.check_header(message.header.frame_id, message.header.stamp)
            target.want(message.numbers, stream=True)

        return listen

    def _begin(self, goal: ReachGoal) -> None:
        """Take over a goal of the action; nothing changes if a part of it is wrong."""
        if not goal.tasks or len(goal.poses) != len(goal.tasks):
            raise SizeMismatch(f"{len(goal.poses)} poses for {len(goal.tasks)} tasks", expected="one pose a task")
        targets = [self.target(name) for name in goal.tasks]
        wanted = [target.part_of(numbers_of(pose)) for target, pose in zip(targets, goal.poses, strict=True)]
        for target, numbers in zip(targets, wanted, strict=True):
            target.check(numbers)
        for target, numbers in zip(targets, wanted, strict=True):
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


def _record_of(record: StackRecord, name: str) -> TaskRecord:
    """Return the record of a task, which may be one of several links."""
    return record.tasks[name] if name in record.tasks else record.tasks[name.rpartition("/")[0]]
