"""The tasks of a component that drives: rows, errors and rates, and the joint velocities that follow from them."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.components.wheeled_motion.joints import CommandedJoints
from solfer.components.wheeled_motion.kernel import WHEELS, find_errors, find_rates
from solfer.components.wheeled_motion.original.kernel import HALF_REVOLUTION, ROUNDED_PI
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.support import TaskRates
from solfer.components.wheeled_motion.tags import (
    ANGLE_ERRORS,
    BASE,
    CAMBER,
    CASTER,
    CONSTRAINTS,
    PACED_STEERING_ERROR,
    STEERING,
    TASK_POINTS,
    VERTICES,
    DrivingTags,
)
from solfer.components.wheeled_motion.wheels import DrivenWheels, rows_of
from solfer.errors import ComponentError
from solfer.numerics.blocks import MemoryBlock
from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot
from solfer.tasks.building.build import build_stack
from solfer.tasks.constraints import joint_bounds
from solfer.tasks.stack import Stack
from solfer.tasks.task import DAMPING


class DrivingTasks:
    """Finds the joint velocities with which base, vertices and wheels follow their references.

    Args:
        robot: The Robot.
        tags: Tags of the component.
        wheels: The wheels, and the points of the tasks.
        moved: DoFs that move, shape (m,).

    Attributes:
        configured: The tasks as they are configured.
        stack: Their levels.
        rows: Rows of each task in the stack, by its name.
        gain: Gains of all rows, shape (rows,) [1/s]; live.
        rates: Errors of all rows, and what they and the references desire.
        descent: Finds joint velocities.
        bounds: Bounds of these; from `prepare` on.
        aims: Directions that wheels turn to, within the ranges of their joints, shape (count,) [rad]; live.
        numbers: What the compiled functions read and write; from `prepare` on.
        find_errors: Finds the errors of all tasks, and before, if its argument is true, where wheels are to point, at
            the rows of this cycle; from `prepare` on.

    Raises:
        SolferError: A tag does not fit the robot.
        SolferErrors: Several of these.
    """

    def __init__(self, robot: Robot, tags: DrivingTags, wheels: DrivenWheels, moved: np.ndarray):
        record = tags.stack_record()
        self.configured = build_stack(record, robot, wheels.points)
        self.configured.confine(moved)
        self.stack = Stack(self.configured.levels)
        self.rows = rows_of(record.levels, self.stack.ends.tolist())
        self.gain = np.concatenate([task.gain for task in self.stack.tasks])
        self.rates = TaskRates(self.rows, self.stack.jacobian, self.stack.velocity, *np.zeros((3, len(self.gain))))
        rigid = 1 if self.rows.get(CONSTRAINTS, slice(1)).start == 0 else 0
        self.descent = DampedDescent(self.stack.ends, self.stack.size, moved, rigid=rigid)
        self._robot = robot
        self._wheels = wheels
        self._feeds_forward = not tags.is_original
        self._damping = self.stack.numbers[:, DAMPING]
        self.aims = np.zeros(len(wheels.links))

    @property
    def holding(self) -> list[Contact]:
        """What keeps the material of each wheel from moving; empty: nothing does."""
        points = (task.point for task in self.configured.tasks.values())
        return [point for point in points if isinstance(point, Contact)]

    def prepare(
        self, tags: DrivingTags, period: float, references: References, steering: Steering, joints: CommandedJoints
    ) -> None:
        """Bind what the cycle reads and writes, so that it looks up nothing by name."""
        self.bounds = joint_bounds(self._robot, period)
        wheels = self._wheels
        offsets = wheels.offsets
        points = wheels.points
        first = {name: rows.start for name, rows in self.rows.items()}
        self.numbers = MemoryBlock(
            WHEELS,
            count=len(wheels.links),
            dofs=self._robot.size,
            rows=len(self.gain),
            law=steering.law,
            wheels=steering.wheels,
            before=steering.before,
            steered=steering.steered,
            places=offsets.states,
            errors=offsets.errors,
            offsets=offsets.value,
            directions=offsets.directions,
            lifted=references.lifted,
            base=offsets.base,
            numbers=references.numbers,
            motion=references.motion,
            velocities=references.places,
            orientations=references.orientations,
            desired_camber=references.camber,
            desired_caster=references.caster,
            pose=wheels.pose.value,
            center=(wheels.place if tags.base == "center_of_mass" else wheels.pose.value)[:2],
            place=wheels.place,
            camber=points[TASK_POINTS[CAMBER]].value,
            caster=points[TASK_POINTS[CASTER]].value,
            turning_count=len(wheels.steering),
            turning_dofs=wheels.steering,
            measured=self._robot.state.position,
            position=joints.position,
            velocity=joints.velocity,
            has_ranges=self._feeds_forward,
            lower=self.bounds.lower_position,
            upper=self.bounds.upper_position,
            **{f"of_{rows}": first.get(task, -1) for task, rows in (*TASK_POINTS.items(), (STEERING, "steering"))},
            steering_rows=self.stack.jacobian[self.rows[STEERING]] if STEERING in first else None,
            aims=self.aims,
            largest_errors=np.array(
                [
                    PACED_STEERING_ERROR if tags.is_paced else ANGLE_ERRORS[STEERING],
                    ANGLE_ERRORS[CAMBER],
                    ANGLE_ERRORS[CASTER],
                ]
            ),
            error=self.rates.error,
            gain=self.gain,
            rates=self.stack.velocity,
            away=self.rates.away,
            forward=self.rates.forward,
            half=HALF_REVOLUTION if self._feeds_forward else ROUNDED_PI,
        )
        self.find_errors = partial(find_errors, self.numbers.address)
        self.limit(tags.speeds, tags.accelerations, (tags.correction, tags.turn_correction, tags.furthest))

    def limit(self, speeds: Sequence[float], accelerations: Sequence[float], corrections: Sequence[float]) -> None:
        """Set the largest speeds and accelerations of base, heading and vertices, and the limits of corrections.

        Args:
            speeds: Largest speeds [m/s, rad/s, m/s].
            accelerations: Largest accelerations [m/s2, rad/s2, m/s2].
            corrections: Largest speeds by errors of the base and its orientation, and the largest error
                [m/s, rad/s, m].
        """
        record = self.numbers.record
        record["base_speed"], record["turn_speed"], record["vertex_correction"] = speeds
        record["base_acceleration"], record["turn_acceleration"], record["vertex_acceleration"] = accelerations
        record["base_correction"], record["turn_correction"], record["furthest"] = corrections

    def tune(self, numbers: np.ndarray) -> None:
        """Go on with other gains and dampings of all rows, shape (2, rows)."""
        self.gain[:], self._damping[:] = numbers
        first = 0
        for task in self.stack.tasks:
            rows = slice(first, first + task.rows)
            task.gain[:], task.damping[:] = numbers[:, rows]
            first = rows.stop

    def start(self) -> None:
        """Begin with errors that nothing makes go away yet."""
        self.rates.away[:] = 0.0

    def solve(self, is_paced: bool, position: np.ndarray) -> np.ndarray:
        """Return the joint velocities by which the errors go away, and with which what is desired goes on.

        Args:
            is_paced: Whether there is a pace, with which errors move nothing faster than they may.
            position: Commanded positions of the joints, shape (n,) [rad, m].

        Raises:
            ComponentError: With a pace, base or vertices are farther from their references than they may be.
        """
        far = find_rates(self.numbers.address, is_paced, self._feeds_forward)
        if far >= 0:
            self._raise_far(far)
        bounds = None
        if self._feeds_forward:
            bounds = self.bounds
            bounds.update(position)
        return self.descent.update(self.stack.jacobian, self.stack.velocity, self._damping, bounds)

    def _raise_far(self, row: int) -> None:
        """Name what is farther from its reference than it may be."""
        base = self.rows.get(BASE)
        what = "the base"
        if base is None or not base.start <= row < base.stop:
            index = (row - self.rows[VERTICES].start) % len(self._wheels.contacts)
            what = f"the vertex of '{self._wheels.contacts[index].name}'"
        raise ComponentError(
            f"{what} is {abs(self.rates.error[row]):.2f} m from its reference",
            expected=f"{float(self.numbers.record['furthest']):g} m at most, the tag `furthest`",
        )
