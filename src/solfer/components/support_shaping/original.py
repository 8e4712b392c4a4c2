"""Support shaping as the original program's `NwheelsZMPII` has it: a quadratic program, and how it sees the wheels."""

import numpy as np

from solfer.components.support_shaping.joint_program import JointProgram, RollingWheels
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.components.wheeled_motion.joints import CommandedJoints
from solfer.components.wheeled_motion.kernel import find_soft
from solfer.components.wheeled_motion.original.kernel import ROUNDED_PI
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.tags import ANGLE_ERRORS, BASE, CAMBER, CONSTRAINTS, STEERING, VERTICES
from solfer.components.wheeled_motion.tasks import DrivingTasks
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.dynamics import BIAS
from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.robot import Robot
from solfer.tasks.task import DAMPING


class WorldVertices:
    """References of the vertices in the world, and what the original knows of the vertices.

    It computes the errors in every second cycle, and looks where vertices are at every third of two times in a cycle:
    before the errors, and before the Jacobians.

    Args:
        count: Number of wheels.

    Attributes:
        references: Where vertices are to be, x and y in the world, shape (count, 2) [m].
        errors: Errors along the directions of rolling, shape (count,) [m].
        jacobian: Jacobian along them, shape (count, n).
    """

    def __init__(self, count: int, size: int):
        self.references, self._places, self._directions = np.zeros((3, count, 2))
        self.errors = np.zeros(count)
        self.jacobian = np.zeros((count, size))
        self._jacobians = np.zeros((count, 2, size))
        self._cycle = 0

    def start(self, places: np.ndarray) -> None:
        """Begin with references where the vertices are, shape (count, 3) [m]."""
        self.references[:] = places[:, :2]
        self._cycle = 0

    def move(self, velocities: np.ndarray, directions: np.ndarray, period: float) -> None:
        """Move references along the directions of rolling, shape (count, 2), by velocities of the vertices [m/s]."""
        along = (velocities * directions).sum(axis=1)
        for index in range(len(along)):
            if np.hypot(*velocities[index]) > 1e-4:  # [m/s]
                self.references[index] += period * along[index] * directions[index]

    def see(self, places: np.ndarray, directions: np.ndarray, jacobians: np.ndarray) -> None:
        """Take over what there is to know in this cycle, and compute errors and Jacobian.

        Args:
            places: Vertices in the world, shape (count, 3) [m].
            directions: Their directions of rolling, shape (count, 2).
            jacobians: Their Jacobians, x and y, shape (count, 2, n).
        """
        if self._cycle % 3 == 2 or self._cycle == 0:
            self._look(places, directions, jacobians)
        if self._cycle % 2 == 0:
            np.sum(self._directions * (self.references - self._places), axis=1, out=self.errors)
        if self._cycle % 3 == 0:
            self._look(places, directions, jacobians)
        for index, direction in enumerate(self._directions):
            np.dot(direction, self._jacobians[index], out=self.jacobian[index])
        self._cycle += 1

    def _look(self, places: np.ndarray, directions: np.ndarray, jacobians: np.ndarray) -> None:
        self._places[:] = places[:, :2]
        self._directions[:] = directions
        self._jacobians[:] = jacobians


class OriginalShaping:
    """Joint velocities of the original: those of a quadratic program show where wheels and vertices go.

    Args:
        robot: The Robot.
        tags: Tags of the component.
        wheels: The wheels.
        tasks: The tasks.
        references: What is desired.
        joints: What is commanded.

    Attributes:
        program: The quadratic program.
    """

    def __init__(
        self,
        robot: Robot,
        tags: SupportShapingTags,
        wheels: DrivenWheels,
        tasks: DrivingTasks,
        references: References,
        *,
        joints: CommandedJoints,
    ):
        robot.dynamics.subscribe(BIAS)
        self._robot = robot
        self._wheels = wheels
        self._tasks = tasks
        self._references = references
        self._joints = joints
        count = len(wheels.links)
        radii = [
            (float(tags.major_axis or wheel.major_axis or 0.0), float(tags.minor_axis or wheel.minor_axis or 0.0))
            for wheel in wheels.contacts
        ]
        hips = robot.links(tags.hips)
        rolling = RollingWheels(robot, tuple(wheels.links), hips, axles=wheels.offsets.axes, radii=radii)
        self.program = JointProgram(robot, tags, rolling, moved=joints.moved)
        self._world = WorldVertices(count, robot.size)
        self._before_camber, self._before_steering = np.zeros((2, count, robot.size))
        self._aims = np.zeros(count)
        self._loads = np.zeros(robot.size)
        ends = tasks.stack.ends
        self._first = DampedDescent(ends[ends <= tasks.rows[BASE].stop], tasks.stack.size, joints.moved)

    def start(self, steering: Steering) -> None:
        """Begin with the wheels as they point."""
        self._references.position[:] = self._wheels.pose.value[:3]
        self._references.camber[:] = 0.0
        self._aims[:] = steering.measured
        self.program.wheels.update()
        self.program.wheels.polygon.start(self.program.wheels.places)
        self._world.start(self.program.wheels.places)
        self._keep_jacobians()

    def update(self, steering: Steering, step: float) -> None:
        """Compute a cycle of a time [s], and integrate it."""
        tasks = self._tasks
        stack = tasks.stack
        self._references.step(step)
        stack.update()
        steering.measure(self._wheels.offsets.directions)
        tasks.find_errors(False)
        self._solve(self._before_camber @ self._robot.state.velocity)
        self._aims += step * (self._before_steering @ self.program.velocity)
        self._keep_jacobians()
        self._move_vertices(step)
        error = tasks.rates.error
        find_soft(steering.measured, self._aims, ROUNDED_PI, ANGLE_ERRORS[STEERING], error[tasks.rows[STEERING]])
        np.multiply(tasks.gain, error, out=stack.velocity)
        velocity = tasks.descent.update(stack.jacobian, stack.velocity, stack.numbers[:, DAMPING])
        self._joints.integrate(velocity, step)

    def _keep_jacobians(self) -> None:
        """Keep Jacobians for the next cycle."""
        jacobian = self._tasks.stack.jacobian
        self._before_camber[:] = jacobian[self._tasks.rows[CAMBER]]
        self._before_steering[:] = jacobian[self._tasks.rows[STEERING]]

    def _solve(self, rates: np.ndarray) -> None:
        """Solve the program of this cycle, with rates of the cambers, shape (count,) [rad/s]."""
        tasks = self._tasks
        stack = tasks.stack
        rows = tasks.rows
        np.multiply(tasks.gain, tasks.rates.error, out=stack.velocity)
        count = rows[BASE].stop
        damping = stack.numbers[:count, DAMPING]
        before = self._first.update(stack.jacobian[:count], stack.velocity[:count], damping)
        self.program.wheels.update()
        self._sum_loads()
        self.program.solve(
            stack.jacobian[rows[CONSTRAINTS]],
            before,
            stack.jacobian[rows[BASE]],
            camber=stack.jacobian[rows[CAMBER]],
            rates=rates,
            force=self._loads,
        )

    def _move_vertices(self, step: float) -> None:
        """Let references of the vertices go on, and write rows and errors as the original sees them."""
        offsets = self._wheels.offsets
        stack = self._tasks.stack
        world = self._world
        world.move(self.program.vertices, offsets.directions, step)
        jacobians = np.array([vertex.jacobian[:2] for vertex in offsets.vertices])
        world.see(self.program.wheels.places, offsets.directions, jacobians)
        rows = self._tasks.rows[VERTICES]
        along = slice(rows.start, rows.start + len(world.errors))
        self._tasks.rates.error[rows] = 0.0
        self._tasks.rates.error[along] = world.errors
        stack.jacobian[rows] = 0.0
        stack.jacobian[along] = world.jacobian

    def _sum_loads(self) -> None:
        """Write the generalised force of the contacts minus the bias force."""
        np.negative(self._robot.dynamics.bias, out=self._loads)
        for wheel in self._wheels.contacts:
            contact = self._robot.contacts[wheel.name]
            self._loads += contact.force @ contact.jacobian[:3]
