"""The component `inverse_kinematics`."""

from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.following.reference_set import ReferenceSet
from solfer.components.inverse_kinematics.deflection import Deflection
from solfer.components.inverse_kinematics.obstacles import obstacles
from solfer.components.inverse_kinematics.soft_level import SoftLevel
from solfer.components.inverse_kinematics.tags import InverseKinematicsTags
from solfer.components.live_tunings import live_tunings
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.declaration import Action, LiveParameter, Service, TopicIn, TopicOut
from solfer.numerics.planar_move import PlanarMove
from solfer.robot import Robot
from solfer.tasks import ReferenceIntegrator, Task
from solfer.tasks.building.build import build_stack


class InverseKinematics(Component):
    """Lets points of the robot follow references: hands, centre of mass, posture, in the order of priority.

    A stack of tasks gives joint velocities, whose integral is commanded, within the limits of the joints.
    References are those of others, or generated: see `ReferenceSet`.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        references: References of its tasks.

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
        self._length = tags.characteristic_length
        self.references = ReferenceSet(
            name,
            tags,
            record,
            stack=self._stack,
            speeds=record.limits.speed_scale * robot.upper_limits.velocity,
            obstacles=self._obstacles,
            holds=bool(self._length),
        )
        self.inputs.update(self.references.inputs)
        self._has_torques = record.limits.torques is not None and not self._is_measured

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz], and make what depends on it; see `Component.set_rate`."""
        super().set_rate(rate)
        if self._is_measured and not self.kinematics:
            raise ComponentError(
                f"'{self.name}' without kinematics is closed on measurements", expected="kinematics: true"
            )
        inner = self._inner
        tags = self.tags
        self._solver = self._stack.solver(self.period, inner.command.position)
        lead = np.inf if tags.lead is None else tags.lead
        self._bounds = self._stack.bounds(self.period)
        self._integrator = ReferenceIntegrator(inner, self.period, self._bounds, lead)
        self.references.connect(self.period)
        self._deflection: Deflection | None = None
        if tags.deflection is not None:
            base = 0 if self.model.kinematics.base is None else 6
            self._deflection = Deflection(
                self.model.size, base, tags.deflection.time_constant, most=tags.deflection.most
            )
        self._levels = tuple(
            SoftLevel(level, [target for target in self.references.list if target.task in level], self._length)
            for level in self._stack.levels
        )

    def services(self) -> tuple[Service, ...]:
        """See `ReferenceInterface.services`."""
        return self.references.interface.services()

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """See `ReferenceInterface.topics`."""
        return self.references.interface.topics()

    def actions(self) -> tuple[Action, ...]:
        """See `ReferenceInterface.actions`."""
        return self.references.interface.actions()

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer the numbers of tasks, the joints' speeds, distances of links, and the deflection, beside references."""
        tags = self.tags
        found = [*self.references.live_parameters()]
        if tags.stack is not None:
            keys = ("gain", "weight", "damping", "correction")
            found += self.references.task_parameters(self._stack, keys, self._take_number)
            limits = ("stack", "limits")
            found.append(
                LiveParameter(
                    (*limits, "speed_scale"),
                    self._stack.scale_speeds,
                    lambda each: each.stack_record().limits.speed_scale,
                )
            )
            if tags.stack.limits.collisions is not None:
                found.append(LiveParameter((*limits, "collisions", "distance"), self._stack.keep_apart, _distance))
        else:
            found += live_tunings(tags, tags.stack_record(), self._stack, write=self._take_tuning)
        if tags.deflection is not None:
            found += [LiveParameter(("deflection", key), self._take_deflection) for key in ("time_constant", "most")]
        return tuple(found)

    def init(self) -> None:
        """Start from where the robot is, at rest: references of tasks without one are where their points are.

        Raises:
            ComponentError: The way to the first value of a generated reference is too fast.
        """
        command = self.model.command
        inner = self._inner
        command.position[:] = self.start_position
        command.velocity[:] = 0.0
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
        self.references.start()

    def update(self) -> None:
        """Compute one cycle."""
        step = self.time_step
        if step != self._integrator.period:
            self._integrator.set_period(step)
        self.references.update(step, self.pace)
        if not self._is_measured:
            self._follow_model()
        self._integrator.update(self._solver.update())
        for level in self._levels:
            level.update()
        self.references.report()

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`. A model that moves its base itself does not follow the measured one."""
        if self._is_measured or 0 not in self._moved:
            self.references.move_world(move)

    def send(self) -> None:
        """Write positions and velocities of the joints that it moves."""
        if self._is_measured:
            return
        command = self.model.command
        inner = self._inner.command
        command.position[self._moved] = inner.position[self._moved]
        command.velocity[self._moved] = inner.velocity[self._moved]

    def reset(self) -> None:
        """Forget what was requested."""
        self.references.reset()

    def stop(self) -> None:
        """Hold the joints where they are desired."""
        self._inner.command.velocity[:] = 0.0
        self.model.command.velocity[:] = 0.0

    def start_log(self, logger: Any) -> None:
        """Declare references, residuals, and the joints that are desired."""
        self.references.log_references(logger)
        add = logger.add
        add("velocity", self._solver.velocity, self.model.dofs)
        if self._deflection is not None:
            add("deflection", self._deflection.value, self.model.dofs)

    def _movable(self) -> np.ndarray:
        """Return the DoFs that it moves: driven joints of the chain, and the base if it belongs to it."""
        robot = self.model
        chain = self.tags.chain
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

    def _take_number(self, task: Task, key: str, numbers: np.ndarray) -> None:
        """Write the numbers of a task; levels have the damping while tasks are far from their references."""
        if key == "damping":
            for level in self._levels:
                level.take_damping(task, numbers)
        else:
            self.references.take_number(task, key, numbers)

    def _take_tuning(self, numbers: np.ndarray) -> None:
        """Write gains and dampings of all rows, shape (2, rows)."""
        first = 0
        for level in self._stack.levels:
            for task in level:
                rows = slice(first, first + task.rows)
                self._take_number(task, "gain", numbers[0, rows])
                self._take_number(task, "damping", numbers[1, rows])
                first = rows.stop

    def _take_deflection(self, tags: InverseKinematicsTags) -> None:
        assert self._deflection is not None
        assert tags.deflection is not None
        self._deflection.time = tags.deflection.time_constant
        self._deflection.most = tags.deflection.most

    def _obstacles(self, task: Task) -> str:
        """Return what keeps a task away from its reference."""
        return obstacles(task, self._inner.command, self._bounds, moved=self._moved)

    def _follow_model(self) -> None:
        """Bring the model to the commanded positions, and what it does not move to the measured ones."""
        inner = self._inner
        measured = self.model.state.position
        state = inner.state
        command = inner.command
        command.position[self._others] = measured[self._others]
        state.position[:] = command.position
        if self._deflection is not None:
            self._deflection.update(measured, command.position, self.time_step)
            state.position += self._deflection.value
        state.velocity[:] = command.velocity
        inner.update()
        if self._has_torques:
            inner.dynamics.update()


def _distance(tags: InverseKinematicsTags) -> float:
    collisions = tags.stack_record().limits.collisions
    assert collisions is not None
    return collisions.distance
