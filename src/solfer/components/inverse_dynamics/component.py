"""The component `inverse_dynamics`."""

import logging
import math
from functools import partial
from typing import Any, cast

import numpy as np

from solfer.components.base import Component
from solfer.components.diagnostics import Entry, Status, Statuses
from solfer.components.following.reference_interface import record_of
from solfer.components.following.reference_set import ReferenceSet, take_numbers
from solfer.components.gains import GAINS, configured_gains, live_gains
from solfer.components.inverse_dynamics.correction import ModelCorrection
from solfer.components.inverse_dynamics.demand import DemandedAccelerations, FedReference
from solfer.components.inverse_dynamics.drift import TaskDrift
from solfer.components.inverse_dynamics.ground import Ground
from solfer.components.inverse_dynamics.holding import Holding
from solfer.components.inverse_dynamics.output import CommandedMotion, CommandedTorques
from solfer.components.inverse_dynamics.problem import WholeBodyProblem
from solfer.components.inverse_dynamics.tags import DynamicTaskRecord, InverseDynamicsTags
from solfer.components.inverse_dynamics.touch import touching
from solfer.components.inverse_dynamics.watch import DynamicsWatch
from solfer.config.tasks.references import ReferenceRecord
from solfer.dynamics import BIAS, INERTIA, CarryingTorques
from solfer.errors import ComponentError, ModelError, UnknownName
from solfer.interfaces.declaration import Action, LiveParameter, Service, TopicIn, TopicOut
from solfer.interfaces.support import LiftContacts, LiftReply
from solfer.numerics.bounds.acceleration import AccelerationBounds
from solfer.numerics.planar_move import PlanarMove
from solfer.points import LookAt
from solfer.robot import Robot
from solfer.tasks import Stack, Task
from solfer.tasks.building.build import ConfiguredTasks

log = logging.getLogger(__name__)

SECOND_LEVEL_WEIGHT = 1e-5
"""Weight of the second level's tasks beside those of the first. These are weights, and no second QP, which would take
as long again: a task of the first level yields by a hundred-thousandth of what the second demands against it, less
than a millimetre where legs are nearly stretched."""


class InverseDynamics(Component):
    """Lets tasks follow their references by torques of the joints, with contacts that carry the robot.

    Each cycle solves one QP for the accelerations of the joints and the forces of contacts; see `WholeBodyProblem`.
    Positions and velocities that are commanded beside the torques are those that the accelerations lead to, and return
    to the measured ones. Where there is no solution, the robot is held where it is: by torques that carry it, and by
    the springs of the lower level. So it is until the next start where what is measured contradicts the QP, see
    `DynamicsWatch`.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        problem: The QP.
        ground: The contacts.
        references: References of its tasks.
        correction: What corrects the model; None without the tag.

    Raises:
        SolferError: The tags name something that the robot does not have, or do not fit it.
        SolferErrors: Several of these.
    """

    Tags = InverseDynamicsTags

    def __init__(self, robot: Robot, tags: InverseDynamicsTags, name: str = "inverse_dynamics"):
        super().__init__(robot, tags, name)
        self.dynamics = True
        if not robot.kinematics.mass > 0.0:
            raise ModelError(
                f"'{robot.name}' has no mass", where=robot.description.where, expected="links with `<inertial>`"
            )
        robot.update()
        self._gains = configured_gains(robot, tags.gains)
        self.ground = Ground(robot, tags, name)
        self._configured, stack = self._make_stack(robot)
        self.references = ReferenceSet(
            name,
            tags,
            tags.stack,
            stack=self._configured,
            speeds=tags.stack.limits.speed_scale * robot.upper_limits.velocity,
            obstacles=self._obstacles,
        )
        self.inputs.update(self.references.inputs)
        twin = robot.twin()
        self._demand = self._make_demand(robot, stack, twin)
        self.correction = ModelCorrection(robot, twin, self.ground) if tags.correct_model else None
        robot.dynamics.subscribe((BIAS, INERTIA))
        passive = np.setdiff1d(np.arange(robot.size), robot.actuated)
        speeds = self._driven_by_speed()
        self.efforts = np.setdiff1d(robot.actuated, [*speeds, *robot.kinematics.followers.dofs])
        self._motion = CommandedMotion(robot, tags.follow)
        self._torques = CommandedTorques(CarryingTorques(robot.dynamics, passive), speeds, robot.size)
        self._standing: list[tuple[np.ndarray, np.ndarray]] = []
        self._watch = DynamicsWatch(robot, self.ground, self.efforts)
        self._holding = Holding(name)

    @property
    def tasks(self) -> dict[str, Task]:
        """The tasks by name."""
        return self._configured.tasks

    @property
    def is_holding(self) -> bool:
        """Whether the last QP had no solution."""
        return bool(self._holding.reason)

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz], and make what depends on it; see `Component.set_rate`.

        Raises:
            ComponentError: A gain is too large for the rate, or the horizon too short.
        """
        super().set_rate(rate)
        robot = self.model
        stack = self.tags.stack
        limits = stack.limits
        for name, task in stack.tasks.items():
            self._require_slow(name, task)
        base = 0 if robot.kinematics.base is None else 6
        lower, upper = (
            limit.position.copy() if limits.joints else np.full(robot.size, sign * math.inf)
            for limit, sign in ((robot.lower_limits, -1.0), (robot.upper_limits, 1.0))
        )
        lower[:base], upper[:base] = -math.inf, math.inf
        speed = self._speed_limits(self.tags)
        # a cycle acts one period after its measurement
        horizon = max(limits.horizon, 2.0 * self.period)
        bounds = AccelerationBounds(lower, upper, speed, braking=limits.braking, horizon=horizon)
        torque_limits = self._torque_limits(self.tags)
        self.problem = WholeBodyProblem(robot, self.ground, bounds, torque_limits=torque_limits, demand=self._demand)
        self._watch.connect(self.problem.force, self._demand.slip)
        if self.correction is not None:
            self.correction.connect()
        self.references.connect(self.period)

    def actions(self) -> tuple[Action, ...]:
        """See `ReferenceInterface.actions`."""
        return self.references.interface.actions()

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer gains, limits, friction and times beside what `ReferenceSet` offers."""
        limits = ("stack", "limits")
        tags = self.tags
        cones = self.ground.cones
        speeds = (
            [LiveParameter((*limits, "speed_scale"), partial(np.copyto, self.problem.bounds.speed), self._speed_limits)]
            if tags.stack.limits.speeds
            else [LiveParameter((*limits, "speed_scale"))]
        )
        return (
            *self.references.live_parameters(),
            *self.references.task_parameters(self._configured, ("weight", "correction"), self._take_number),
            *(
                LiveParameter(("stack", "tasks", name, key), write, partial(self._gains_of, name))
                for name, task in tags.stack.tasks.items()
                for write in (partial(self._take_gains, name),)
                for key in ("velocity_gain",) + (() if task.is_motion else ("gain",))
            ),
            *speeds,
            LiveParameter((*limits, "torque_scale"), self.problem.limit_torques, self._torque_limits),
            LiveParameter((*limits, "braking"), self._take_braking, lambda tags: tags.stack.limits.braking),
            LiveParameter(("friction",), cones.take_ratios, cones.ratios_of),
            LiveParameter(("torsion",), cones.take_ratios, cones.ratios_of),
            LiveParameter(("fade",), self._take_times),
            LiveParameter(("settle",), self._take_settling, lambda tags: tags.settle),
            LiveParameter(("follow",), self._take_times),
            *live_gains(self.model, tags.gains, self._gains),
        )

    def init(self) -> None:
        """Start at rest, with references where the points are."""
        command = self.model.command
        if not self._standing:
            self._standing = [(command[gain], command[gain].copy()) for gain in GAINS if gain in command]
        self._motion.start(self.start_position)
        if self.correction is not None:
            self.correction.start()
        self._demand.stack.update()
        self._configured.start()
        self.references.start()
        self.ground.start()
        if absent := self.ground.leave_out(~touching(self.model, self.ground)):
            log.info("%s: contacts that touch nothing do not count: %s", self.name, ", ".join(absent))
        self._watch.start()
        self._holding.reason = ""
        self._torques.start()
        self._cycles = 0
        self._demand.start()

    def update(self) -> None:
        """Compute one cycle."""
        step = self.time_step
        self._cycles += 1
        if self.correction is not None:
            self.correction.update(step)
        self.references.update(step, self.pace)
        demand = self._demand
        state = self.model.state
        demand.feed(step)
        self.problem.bounds.update(state.position, state.velocity)
        self.ground.update(step)
        demand.update(state, self.ground)
        if not self.is_holding:
            self._watch.update(step)
        is_solved = not self._watch.fault and self.problem.solve()
        if is_solved is self.is_holding:
            self._switch(not is_solved)
        if is_solved:
            np.copyto(self._torques.value, self.problem.torque)
            self._motion.advance(self.problem.acceleration, step)
        else:
            self._torques.hold(self.ground.jacobian)
        self._torques.blend(step)
        for target in self.references.list:
            target.measure()
        self.references.report()

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`."""
        self.references.move_world(move)
        self.ground.cones.move_world(move)
        self._demand.is_smooth = False

    def send(self) -> None:
        """Write torques, and positions and velocities beside them."""
        command = self.model.command
        command.torque[:] = self._torques.value
        command.position[:] = self._motion.position
        command.velocity[:] = self._motion.velocity
        if self.is_holding:
            for values, numbers in self._standing:
                np.copyto(values, numbers)
        else:
            for values, dofs, numbers in self._gains:
                values[dofs] = numbers

    def reset(self) -> None:
        """Forget what was requested."""
        self.references.reset()

    def stop(self) -> None:
        """Hold the joints where they are commanded."""
        self._motion.velocity[:] = 0.0

    def services(self) -> tuple[Service, ...]:
        """Offer the service `<name>/lift` beside those of references."""
        return (
            *self.references.interface.services(),
            Service("lift", "solfer/LiftContacts", LiftContacts, reply=LiftReply, handler=self.lift),
        )

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """Receive references and the ground; publish forces and active constraints on `/diagnostics`."""
        diagnostics = TopicOut("/diagnostics", "diagnostic_msgs/DiagnosticArray", Statuses, self._report, rate=1.0)
        felt = self.ground.cones.felt
        return (*self.references.interface.topics(), *(() if felt is None else felt.topics()), diagnostics)

    def lift(self, request: LiftContacts) -> LiftReply:
        """Lift contacts, or put them down again; nothing changes if one of them is not tracked.

        Raises:
            UnknownName: A contact is not tracked.
        """
        names = self.ground.names
        for name in request.contacts:
            if name not in names:
                raise UnknownName("tracked contact", name, names, expected="a contact of the group `track`")
        for name in request.contacts or names:
            self.ground.lift(names.index(name), request.lifted, self.problem.force)
        return LiftReply()

    def start_log(self, logger: Any) -> None:
        """Declare accelerations, torques, forces of contacts, active constraints, and what tasks demand."""
        dofs = self.model.dofs
        ground = self.ground
        problem = self.problem
        forces = [
            f"{name}.{row}" for index, name in enumerate(ground.names) for row in range(np.diff(ground.starts)[index])
        ]
        self.references.log_references(logger)
        logger.add("acceleration", problem.acceleration, dofs)
        logger.add("torque", self._torques.value, dofs, "Nm")
        logger.add("forces", problem.force, forces, "N")
        logger.add("active", problem.active, problem.names)
        if self.correction is not None:
            logger.add("model_offset", self.correction.offset, ("x", "y", "z", "mass"), ("m", "m", "m", ""))

    def _make_stack(self, robot: Robot) -> tuple[ConfiguredTasks, Stack]:
        """Make the tasks on a Robot; those of the second level weigh less."""
        configured = ConfiguredTasks(self.tags.stack, robot, {})
        for level in configured.levels[1:]:
            for task in level:
                task.weight *= SECOND_LEVEL_WEIGHT
        return configured, Stack(configured.levels)

    def _make_demand(self, robot: Robot, stack: Stack, twin: Robot) -> DemandedAccelerations:
        """Make what the tasks demand, with the gains of all rows; the drift is that of a twin of the robot."""
        tags = self.tags
        twin.state.position[:] = robot.state.position
        twin.update()
        shadow, shadow_stack = self._make_stack(twin)
        aims = [
            (shadow.references[name].value, reference.value)
            for name, reference in self._configured.references.items()
            if isinstance(self.tasks[name].point, LookAt)
        ]
        fed = [
            FedReference(task.name, task.velocity, self.references.targets.get(task.name))
            for task in stack.tasks
            if isinstance(record_of(tags.stack, task.name).reference, ReferenceRecord)
        ]
        demand = DemandedAccelerations(
            stack, TaskDrift(shadow_stack), aims, fed, contact_rows=self.ground.rows.rows, settle=tags.settle
        )
        for task in stack.tasks:
            rows = demand.rows[task.name]
            demand.velocity_gains[rows] = _velocity_gain(cast(DynamicTaskRecord, record_of(tags.stack, task.name)))
            demand.roots[rows] = np.sqrt(task.weight)
        return demand

    def _take_number(self, task: Task, key: str, numbers: np.ndarray) -> None:
        """Write the numbers of a task; a second level weighs less."""
        if key == "weight":
            numbers = numbers * (1.0 if task in self._configured.levels[0] else SECOND_LEVEL_WEIGHT)
            self._demand.roots[self._demand.rows[task.name]] = np.sqrt(numbers)
        self.references.take_number(task, key, numbers)

    def _gains_of(self, name: str, tags: InverseDynamicsTags) -> np.ndarray:
        """Return the gains of a record's tasks, and those of their velocity, which may follow them; shape (2, rows)."""
        record = tags.stack.tasks[name]
        configured = self._configured
        self._require_slow(name, record)
        return np.stack(
            (configured.numbers(name, record, "gain"), configured.rows(name, _as_tag(_velocity_gain(record))))
        )

    def _take_gains(self, name: str, numbers: np.ndarray) -> None:
        """Write what `_gains_of` has returned."""
        take_numbers(self._configured, name, self._take_number, key="gain", numbers=numbers[0])
        first = 0
        for task in self._configured.members(name):
            self._demand.velocity_gains[self._demand.rows[task.name]] = numbers[1, first : first + task.rows]
            first += task.rows

    def _speed_limits(self, tags: InverseDynamicsTags) -> np.ndarray:
        """Return the largest speeds of all DoFs, shape (n,) [rad/s, m/s]."""
        robot = self.model
        limits = tags.stack.limits
        speed = limits.speed_scale * robot.upper_limits.velocity if limits.speeds else np.full(robot.size, math.inf)
        speed[: 0 if robot.kinematics.base is None else 6] = math.inf
        return speed

    def _torque_limits(self, tags: InverseDynamicsTags) -> np.ndarray:
        """Return the largest torques of all DoFs, shape (n,) [Nm, N]."""
        return tags.stack.limits.torque_scale * self.model.upper_limits.torque

    def _require_slow(self, name: str, task: DynamicTaskRecord) -> None:
        """Check that no cycle corrects more than the whole error of a task; a ComponentError if one does."""
        gain = float(np.max(_velocity_gain(task)))
        rate = 1.0 / self.period
        if gain * self.period >= 1.0:
            key = "velocity_gain" if task.velocity_gain is not None else "gain"
            raise ComponentError(
                f"a velocity gain of {gain:g} /s of task '{name}' at {rate:g} Hz",
                where=task.where(key) or task.where(),
                expected=f"less than {rate:g} /s: a cycle may not correct more than the whole error",
            )

    def _take_braking(self, braking: np.ndarray) -> None:
        self.problem.bounds.braking = float(braking)

    def _take_settling(self, settle: np.ndarray) -> None:
        self._demand.settle = float(settle)

    def _take_times(self, tags: InverseDynamicsTags) -> None:
        self.ground.fade = tags.fade
        self._motion.follow = tags.follow

    def _obstacles(self, _task: Task) -> str:
        """Return what keeps a task away from its reference."""
        return (
            f"it holds: {self._holding.reason}"
            if self.is_holding
            else f"active constraints: {self._active() or 'none'}"
        )

    def _active(self) -> str:
        """Return the names of active constraints."""
        return ", ".join(self.problem.names[index] for index in np.flatnonzero(self.problem.active))

    def _driven_by_speed(self) -> np.ndarray:
        """Return the DoFs whose drives take speeds alone, shape (m,)."""
        if self.tags.speed_driven is None:
            return np.zeros(0, dtype=np.int64)
        try:
            return self.model.selectors[self.tags.speed_driven].indices
        except UnknownName as error:
            raise error.at(self.tags.where("speed_driven")) from None

    def _switch(self, is_holding: bool) -> None:
        """Begin to hold the robot where it is, or go on with the tasks."""
        state = self.model.state
        self._torques.change(self._torques.value if self._cycles > 1 else state.torque)
        self._motion.start(state.position)
        if self._watch.fault:
            self._holding.fail(self._watch.fault)
        elif is_holding:
            self._holding.wait(self.problem.violated)
        else:
            self._holding.reason = ""
            self._watch.start()

    def _report(self) -> Statuses:
        problem = self.problem
        ground = self.ground
        entries = [
            Entry(name, f"{float(force):.1f} N")
            for name, force in zip(ground.names, ground.normals @ problem.force, strict=True)
        ]
        entries.append(Entry("active constraints", self._active()))
        summary = f"it holds: {self._holding.reason}" if self.is_holding else "tasks are followed"
        level = int(self.is_holding)
        tasks = Status(level, f"{self.name}: tasks", summary, hardware_id=self.name, values=tuple(entries))
        correction = self.correction
        return Statuses(status=(tasks,) if correction is None else (tasks, correction.report(self.name)))


def _as_tag(numbers: np.ndarray) -> float | tuple[float, ...]:
    return tuple(numbers.tolist()) if numbers.ndim else float(numbers)


def _velocity_gain(task: DynamicTaskRecord) -> np.ndarray:
    """Return the gain of a task's velocity [1/s], one number or one a row."""
    if task.velocity_gain is not None:
        return np.array(task.velocity_gain, dtype=float)
    gain = 0.0 if task.is_motion and task.gain is None else 1.0 if task.gain is None else task.gain
    # errors vanish without swinging; 10/s where there is no position
    return np.where(np.array(gain) > 0.0, 4.0 * np.array(gain), 10.0)
