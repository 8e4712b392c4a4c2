"""Velocities of the vertices, near those that are desired, that keep the limits of polygon and legs."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.components.support_shaping.polygon import FootprintGeometry
from solfer.numerics.solvers.qp import QpSolver

VELOCITY_TOLERANCE = 1e-6
"""Difference of velocities that changes nothing [m/s]."""


class LimitRows:
    """Rows of the limits by the velocities of the vertices, and what they demand.

    Args:
        rows: Where the rows are written, shape (2 count, 2 count); live.
        limits: Least margins and largest distances, shape (2, count) [m]; live.

    Attributes:
        reserves: What is left of each limit, margins before workspaces, shape (2 count,) [m]; live.
        demand: Least rates of margins and legs, shape (2 count,) [m/s]; live.
        horizon: Time in which a reserve may be used up [s]; may be set.
        recovery: Largest speed of the way back [m/s]; may be set.
    """

    def __init__(self, rows: np.ndarray, limits: np.ndarray):
        count = limits.shape[1]
        self._rows = rows
        self._limits = limits
        self._index = np.arange(count)[:, None]
        self._order: list[tuple[int, int]] | None = None
        self._places = np.zeros((2, count, 2), dtype=int)
        self.reserves, self.demand = np.zeros((2, 2 * count))
        self.horizon = self.recovery = 1.0

    def update(self, polygon: FootprintGeometry, infeasible: np.ndarray) -> None:
        """Write rows and demands of a polygon; what is infeasible and is kept again counts as feasible."""
        count = len(polygon.edges)
        margins, workspaces = self._limits
        index = self._index
        if self._order is not polygon.edges:
            self._order = polygon.edges
            self._places[:] = 2 * np.array(polygon.edges).T[:, :, None] + (0, 1)
            self._rows[:] = 0.0
        starts, ends = self._places
        self._rows[index, starts] = polygon.of_start
        self._rows[index, ends] = polygon.of_end
        self._rows[count + index, 2 * index + (0, 1)] = (
            polygon.legs[:, :2] / np.maximum(polygon.distances, 1e-9)[:, None]
        )
        np.subtract(polygon.margins, margins, out=self.reserves[:count])
        np.subtract(workspaces, polygon.distances, out=self.reserves[count:])
        np.multiply(self.reserves, -1.0 / self.horizon, out=self.demand)
        np.minimum(self.demand, self.recovery, out=self.demand)
        infeasible &= self.reserves < 0.0
        if infeasible.any():
            np.minimum(self.demand, 0.0, out=self.demand)


class SupportGovernor:
    """Changes desired velocities of the vertices, seen from the base, as little as the limits of the polygon request.

    With the velocities u of the vertices in the heading frame, u_w of those that are desired, the margins m with their
    gradients M and the distances l of wheels from hips (with their directions e), and slacks s:

        least  |u - u_w|^2 + margin_gain |s_m|^2 + workspace_gain |s_l|^2
        with   M u + s_m >= max(-(m - limit) / T, ...),   e u - s_l <= (limit - l) / T,   |u| <= largest speed

    A margin that is too small grows with at most `recovery`, a leg that is too long gets shorter likewise. Where a
    limit does not come back within a second, all that are exceeded then are infeasible until they are kept again:
    nothing brings them back, they only get no worse, and the ratio of the desired motion falls. Where the program
    cannot be solved the vertices hold.

    Args:
        margins: Least margins, shape (count,) [m].
        workspaces: Largest distances, shape (count,) [m].
        gains: Weights of what margins, and what workspaces lack.
        horizon: T [s].
        recovery: Largest speed of the way back [m/s].
        speed: Largest speed of a vertex [m/s].
        holds: Whether the motion holds where a limit cannot be kept, or slows down.

    Attributes:
        limits: Least margins and largest distances, shape (2, count) [m]; live.
        speed: Largest speed of a vertex [m/s]; may be set.
        velocities: Velocities of the vertices, shape (count, 2) [m/s]; live.
        active: The limits that changed a velocity, shape (2 count,); live.
        infeasible: The limits that are exceeded and could not be brought back, shape (2 count,); live.
        ratio: Ratio of the desired velocities that goes on.
    """

    def __init__(
        self,
        margins: np.ndarray,
        workspaces: np.ndarray,
        gains: tuple[float, float],
        horizon: float,
        recovery: float,
        *,
        speed: float,
        holds: bool,
    ):
        count = len(margins)
        self.limits = np.array((margins, workspaces))
        self.speed = speed
        self._lowest = 0.0 if holds else 0.2
        self.velocities = np.zeros((count, 2))
        self._desired, self._reached, self._missed = np.zeros((3, 2 * count))
        self.active, self.infeasible = np.zeros((2, 2 * count), dtype=bool)
        self._solver = QpSolver(4 * count, 0, 2 * count)
        problem = self._solver.problem
        size = 2 * count
        problem.hessian[np.arange(size), np.arange(size)] = 1.0
        problem.inequality_matrix[:, size:] = np.eye(size)
        problem.x_min[size:] = 0.0
        self._matrix = problem.inequality_matrix[:, :size]
        self._rows = LimitRows(self._matrix, self.limits)
        self.tune(gains, horizon, recovery)
        self._period = 0.0
        self.start()

    def tune(self, gains: Sequence[float], horizon: float, recovery: float) -> None:
        """Set the weights, the horizon and the speed of the return, see above."""
        self._rows.horizon = horizon
        self._rows.recovery = recovery
        slacks = np.arange(2 * self.limits.shape[1], 4 * self.limits.shape[1])
        self._solver.problem.hessian[slacks, slacks] = np.repeat(gains, self.limits.shape[1])

    @property
    def reserves(self) -> np.ndarray:
        """What is left of each limit, margins before workspaces, shape (2 count,) [m]; live."""
        return self._rows.reserves

    def set_period(self, period: float) -> None:
        """Set the period of the control cycle [s]."""
        self._period = period

    def start(self) -> None:
        """Begin with the whole motion."""
        self.ratio = 1.0
        self.active[:] = False
        self.infeasible[:] = False
        self._missed[:] = 0.0

    def update(self, polygon: FootprintGeometry, desired: np.ndarray) -> None:
        """Compute the velocities of this cycle.

        Args:
            polygon: The polygon, in the frame of the heading.
            desired: Velocities that are desired of the vertices there, shape (count, 3) [m/s].
        """
        count = len(desired)
        np.multiply(desired[:, :2], self.ratio, out=self._desired.reshape(count, 2))
        self._rows.update(polygon, self.infeasible)
        np.dot(self._matrix, self._desired, out=self._reached)
        if (self._reached >= self._rows.demand).all():
            self.velocities.ravel()[:] = self._desired
            self.active[:] = False
            self._missed[:] = 0.0
        else:
            self._solve()
        step = self._period * (-2.0 if self.infeasible.any() else 1.0)  # [1/s]
        self.ratio = min(max(self.ratio + step, self._lowest), 1.0)

    def _solve(self) -> None:
        problem = self._solver.problem
        demand = self._rows.demand
        size = len(self._desired)
        np.negative(self._desired, out=problem.gradient[:size])
        problem.lower[:] = demand
        largest = max(self.speed, float(np.abs(self._desired).max()))
        problem.x_min[:size] = -largest
        problem.x_max[:size] = largest
        solution = self._solver.solve()
        x = solution.x
        if not solution.is_solved:
            # slacks make every program feasible, but not every one can be solved exactly
            self.velocities[:] = 0.0
            np.less(self._reached, demand, out=self.active)
            self.infeasible |= self.active
            return
        self.velocities.ravel()[:] = x[:size]
        np.dot(self._matrix, x[:size], out=self._reached)
        np.less(self._reached, demand + VELOCITY_TOLERANCE, out=self.active)
        # half of the way back is missed
        is_missed = (x[size:] > 0.5 * demand) & (demand > VELOCITY_TOLERANCE)
        np.add(self._missed, self._period, out=self._missed)
        self._missed[~is_missed] = 0.0
        if self._missed.max() > 1.0:  # [s]
            np.less(self.reserves, 0.0, out=self.infeasible)


class Reaction:
    """Moves the support polygon under a robot that is pushed.

    The capture point of the linear inverted pendulum, c + (dc/dt - v) / w with w = sqrt(g / z), the centre of mass c at
    the height z and the velocity v of the polygon, is where the robot would come to rest over a polygon that goes on.
    As long as it is nearer to an edge than `margin`, the polygon accelerates that way; else it comes to rest. Source:
    J. Pratt, J. Carff, S. Drakunov, A. Goswami, "Capture point: a step toward humanoid push recovery", Humanoids 2006.

    Args:
        margin: Distance of the capture point from an edge that is desired [m].
        speed: Largest speed of the polygon [m/s].

    Attributes:
        margin: As above; may be set.
        velocity: Velocity of the polygon, x and y in the frame of the heading [m/s].
        margins: Margins of the capture point, shape (count,) [m].
        is_active: Whether it moves the polygon.
    """

    GAIN = 60.0
    """Acceleration for what is missing [1/s2]."""

    ACCELERATION = 12.0
    """Largest acceleration [m/s2]."""

    BRAKING = 1.0
    """Acceleration of coming to rest [m/s2]."""

    def __init__(self, count: int, margin: float, speed: float):
        self.margin = margin
        self._speed = speed
        self._polygon = FootprintGeometry(count)
        self.start()

    def start(self, edges: list[tuple[int, int]] | None = None) -> None:
        """Begin at rest."""
        self.velocity = (0.0, 0.0)
        self.is_active = False
        if edges is not None:
            self._polygon.edges = edges

    @property
    def margins(self) -> np.ndarray:
        """Margins of the capture point, shape (count,) [m]."""
        return self._polygon.margins

    def update(
        self, vertices: list[list[float]], center: tuple[float, float, float], rate: tuple[float, float], period: float
    ) -> tuple[float, float]:
        """Compute and return the velocity of this cycle.

        Args:
            vertices: Vertices in the frame of the heading [m].
            center: Centre of mass there, and its height over the ground [m].
            rate: Its velocity there [m/s].
            period: Period of the control cycle [s].
        """
        vx, vy = self.velocity
        lead = math.sqrt(max(center[2], 0.05) / 9.81)
        point = center[0] + lead * (rate[0] - vx), center[1] + lead * (rate[1] - vy)
        self._polygon.update(vertices, point)
        ax = ay = 0.0
        for margin, (nx, ny) in zip(self._polygon.margins.tolist(), self._polygon.of_point.tolist(), strict=True):
            missing = max(self.margin - margin, 0.0)
            # the gradient of the margin by the point leads inwards
            ax = ax - missing * nx
            ay = ay - missing * ny
        size = self.GAIN * math.hypot(ax, ay)
        if size > 0.0:
            ratio = self.GAIN * min(1.0, self.ACCELERATION / size) * period
            vx = vx + ratio * ax
            vy = vy + ratio * ay
        else:
            speed = math.hypot(vx, vy)
            ratio = max(0.0, 1.0 - self.BRAKING * period / speed) if speed > 0.0 else 0.0
            vx = ratio * vx
            vy = ratio * vy
        speed = math.hypot(vx, vy)
        if speed > self._speed:
            vx = vx * self._speed / speed
            vy = vy * self._speed / speed
        self.velocity = (vx, vy)
        self.is_active = speed > VELOCITY_TOLERANCE
        return self.velocity
