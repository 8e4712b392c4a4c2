"""The quadratic program of the original: joint velocities that shape the support polygon."""

from collections.abc import Sequence

import numpy as np

from solfer.components.support_shaping.polygon import FootprintGeometry
from solfer.components.support_shaping.rolling import rolling_map
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.dynamics import INERTIA
from solfer.numerics.solvers.qp import QpSolver, Solution
from solfer.points import SpatialPoint
from solfer.robot import Robot


class RollingWheels:
    """Vertices of wheels that roll, their polygon, and what moves them.

    Args:
        robot: The Robot.
        wheels: Links of the wheels.
        hips: Links of their hips.
        axles: Axes of the wheels in the frames of their links, shape (count, 3).
        radii: Radii of ring and tube of each wheel [m].

    Attributes:
        centers: Poses of the wheels' links.
        hips: Poses of the hips.
        places: The vertices, shape (count, 3) [m]; live.
        rolling: Rows of the vertices' velocities while the wheels roll, x and y of each, shape (2 count, n); live.
        turning: Rows of the wheels' angular velocities, shape (3 count, n); live.
        polygon: The polygon of the vertices; the point is the centre of pressure.
        period: Period of the control cycle [s]; may be set.
    """

    def __init__(
        self,
        robot: Robot,
        wheels: tuple[str, ...],
        hips: Sequence[str],
        axles: np.ndarray,
        radii: list[tuple[float, float]],
    ):
        count = len(wheels)
        self._robot = robot
        self._links = wheels
        self._axles = axles
        self._radii = radii
        self.centers = [SpatialPoint(link, robot) for link in wheels]
        self.hips = [SpatialPoint(link, robot) for link in hips]
        self.places = np.zeros((count, 3))
        self.rolling = np.zeros((2 * count, robot.size))
        self.turning = np.zeros((3 * count, robot.size))
        self.polygon = FootprintGeometry(count)
        self.period = 0.0

    def update(self) -> None:
        """Compute vertices, margins and workspaces at the last update of the Robot."""
        robot = self._robot
        legs = []
        for index, (center, hip) in enumerate(zip(self.centers, self.hips, strict=True)):
            center.update()
            hip.update()
            axis = robot.kinematics.rotation(self._links[index]) @ self._axles[index]
            ring, tube = self._radii[index]
            turning = center.jacobian[3:]
            self.turning[3 * index : 3 * index + 3] = turning
            rolling = rolling_map(axis, turning @ robot.state.velocity, ring, tube=tube, period=self.period)
            np.dot(rolling[:2], turning, out=self.rolling[2 * index : 2 * index + 2])
            slope = float(axis[2])
            lowest = (np.array((0.0, 0.0, 1.0)) - slope * axis) / np.sqrt(1.0 - slope**2)
            self.places[index] = center.value[:3] - ring * lowest
            self.places[index, 2] -= tube
            legs.append((hip.value[:3] - center.value[:3]).tolist())
        self.polygon.update(self.places.tolist(), robot.center_of_pressure.value.tolist())
        self.polygon.measure_legs(legs)


class JointProgram:
    """Velocities of the joints for which vertices move least while margins and workspaces hold.

    The unknowns are the velocities dq of the moved DoFs, and a slack s <= 0 for each margin m and workspace w (squared
    distance), with V the rows of the vertices' velocities while the wheels roll, Y those of the wheels' angular
    velocities, of the centre of mass and of the hips:

        least  |V dq|^2 + 5e-6 |Y dq|^2 + 1e-7 |dq|^2 + margin_gain |s_m|^2 + workspace_gain |s_w|^2
        with   (m - limit) / T + dm/dq dq >= s_m,   (limit^2 - w) / T - dw/dq dq >= s_w

    while contacts do not move, the base has its measured velocity, joints stay in their ranges, speeds and torques,
    and the rates of camber what they are.

    Args:
        robot: The Robot.
        tags: Tags of the component.
        wheels: The wheels.
        moved: DoFs that move, shape (m,).

    Attributes:
        solver: The program.
        velocity: Joint velocities of the solution, zero if there is none, shape (n,); live.
        vertices: Velocities of the vertices then, shape (count, 2) [m/s]; live.
        wheels: As above.
        infeasible: How many programs had no solution.
    """

    def __init__(self, robot: Robot, tags: SupportShapingTags, wheels: RollingWheels, moved: np.ndarray):
        count = len(wheels.centers)
        size = len(moved)
        self._robot = robot
        self.wheels = wheels
        self._moved = moved
        self._pelvis = SpatialPoint(str(robot.kinematics.base_link), robot) if tags.centers else None
        self.limits = np.array((tags.each("margins", count), tags.each("workspaces", count)))
        self.velocity = np.zeros(robot.size)
        self.vertices = np.zeros((count, 2))
        effort = robot.upper_limits.torque
        self._driven = moved[np.isfinite(effort[moved]) & (effort[moved] > 0.0)]
        self._torques, self._cambers = slice(0, len(self._driven)), slice(len(self._driven), len(self._driven) + count)
        first = self._cambers.stop
        self._soft = slice(first, first + 2 * count)
        self.solver = QpSolver(size + 2 * count, 3 * count + 6, first + 2 * count)
        problem = self.solver.problem
        self.weigh((tags.margin_gain, tags.workspace_gain))
        problem.inequality_matrix[self._soft, size:] = -np.eye(2 * count)
        problem.x_max[size:] = 0.0
        self.infeasible = 0
        robot.dynamics.subscribe(INERTIA)

    def weigh(self, gains: Sequence[float]) -> None:
        """Set the weights of what margins, and what workspaces lack."""
        count = len(self.wheels.centers)
        slacks = np.arange(len(self._moved), len(self._moved) + 2 * count)
        self.solver.problem.hessian[slacks, slacks] = np.repeat(gains, count)

    def solve(
        self,
        contacts: np.ndarray,
        before: np.ndarray,
        base: np.ndarray,
        camber: np.ndarray,
        rates: np.ndarray,
        *,
        force: np.ndarray,
    ) -> Solution:
        """Solve the program of this cycle, after an update of the wheels.

        Args:
            contacts: Jacobian of the contacts, shape (3 count, n).
            before: Joint velocities before this task, which it keeps for the contacts, shape (n,).
            base: Jacobian of the base, shape (6, n).
            camber: Jacobian of the cambers, shape (count, n).
            rates: The cambers' present rates, shape (count,) [rad/s].
            force: Generalised force of the contacts minus the bias force, shape (n,) [Nm, N].
        """
        self._write_cost()
        self._write_equalities(contacts, before, base)
        self._write_bounds()
        problem = self.solver.problem
        moved = self._moved
        size = len(self._moved)
        self._write_torques(force)
        problem.inequality_matrix[self._cambers, :size] = camber[:, moved]
        tolerance = 1e-5  # [rad/s] by which the rate of a camber may differ from its present one
        problem.lower[self._cambers] = rates - tolerance
        problem.upper[self._cambers] = rates + tolerance
        self._write_soft()
        solution = self.solver.solve()
        self.velocity[:] = 0.0
        if solution.is_solved:
            self.velocity[moved] = solution.x[:size]
        else:
            self.infeasible += 1
        self.vertices.ravel()[:] = self.wheels.rolling @ self.velocity
        return solution

    def _write_cost(self) -> None:
        moved = self._moved
        hessian = self.solver.problem.hessian
        size = len(self._moved)
        rolling = self.wheels.rolling[:, moved]
        center = self._robot.center_of_mass.jacobian[:2, moved]
        counted = [self.wheels.turning[:, moved], center, *(hip.jacobian[:3, moved] for hip in self.wheels.hips)]
        if self._pelvis is not None:
            self._pelvis.update()
            counted.append(self._pelvis.jacobian[:2, moved])
            counted.extend(point.jacobian[:2, moved] for point in self.wheels.centers)
        rows = np.concatenate(counted)
        hessian[:size, :size] = rolling.T @ rolling + 5e-6 * (rows.T @ rows)
        hessian[np.arange(size), np.arange(size)] += 1e-7

    def _write_equalities(self, contacts: np.ndarray, before: np.ndarray, base: np.ndarray) -> None:
        problem = self.solver.problem
        moved = self._moved
        size = len(self._moved)
        rows = len(contacts)
        problem.equality_matrix[:rows, :size] = contacts[:, moved]
        problem.equality_matrix[rows:, :size] = base[:, moved]
        problem.equality_vector[:rows] = contacts @ before
        problem.equality_vector[rows:] = base @ self._robot.state.velocity

    def _write_bounds(self) -> None:
        """Write the speeds with which joints reach the ends of their ranges, desired and measured, and no more."""
        robot = self._robot
        problem = self.solver.problem
        moved = self._moved
        size = len(self._moved)
        for position in (robot.state.position, robot.command.position):
            lower = (robot.lower_limits.position - position)[moved] / self.wheels.period
            upper = (robot.upper_limits.position - position)[moved] / self.wheels.period
            if position is robot.state.position:
                problem.x_min[:size] = lower
                problem.x_max[:size] = upper
            else:
                np.maximum(problem.x_min[:size], lower, out=problem.x_min[:size])
                np.minimum(problem.x_max[:size], upper, out=problem.x_max[:size])
        speed = robot.upper_limits.velocity[moved]
        problem.x_min[:size] = np.minimum(np.maximum(problem.x_min[:size], -speed), 0.0)
        problem.x_max[:size] = np.maximum(np.minimum(problem.x_max[:size], speed), 0.0)

    def _write_torques(self, force: np.ndarray) -> None:
        robot = self._robot
        problem = self.solver.problem
        driven = self._driven
        moved = self._moved
        inertia = robot.dynamics.inertia
        problem.inequality_matrix[self._torques, : len(moved)] = inertia[np.ix_(driven, moved)]
        now = (inertia @ robot.state.velocity)[driven]
        problem.lower[self._torques] = now + (force + robot.lower_limits.torque)[driven] * self.wheels.period
        problem.upper[self._torques] = now + (force + robot.upper_limits.torque)[driven] * self.wheels.period

    def _write_soft(self) -> None:
        problem = self.solver.problem
        moved = self._moved
        size = len(self._moved)
        polygon = self.wheels.polygon
        count = len(polygon.edges)
        rows = problem.inequality_matrix[self._soft, : len(moved)]
        center = self._robot.center_of_mass.jacobian[:2]
        for index, (first, second) in enumerate(polygon.edges):
            row = polygon.of_start[index] @ self.wheels.rolling[2 * first : 2 * first + 2]
            row += polygon.of_end[index] @ self.wheels.rolling[2 * second : 2 * second + 2]
            rows[index] = (row + polygon.of_point[index] @ center)[moved]
            leg = 2.0 * polygon.legs[index, :2]
            wheel = self.wheels.centers[index].jacobian[:2]
            wheel = wheel if self._pelvis is not None else self.wheels.rolling[2 * index : 2 * index + 2]
            rows[count + index] = (leg @ (wheel - self.wheels.hips[index].jacobian[:2]))[moved]
        problem.inequality_matrix[self._soft, :size] = rows
        margins, workspaces = self.limits
        lower = problem.lower[self._soft]
        lower[:count] = -(polygon.margins - margins) / self.wheels.period
        lower[count:] = -(workspaces**2 - polygon.distances**2) / self.wheels.period
