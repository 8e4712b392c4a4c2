"""Constraints on the joint velocities of QP levels."""

import numpy as np
from numpy.typing import ArrayLike

from solfer.dynamics import BIAS, INERTIA, DynamicModel
from solfer.errors import NotFinite, SizeMismatch, TaskError
from solfer.model.view import RobotView
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.points import Handler, Point
from solfer.tasks.kernel import limit_square
from solfer.tasks.task import as_numbers, updated_in_order


class Constraint:
    """A constraint lower <= C dq <= upper. A subclass writes changes to the arrays in `update`.

    Args:
        name: Name of the constraint, for errors.
        matrix: C, shape (rows, n).
        lower: Lower bounds, shape (rows,) or one number; -inf where there is none.
        upper: Upper bounds, shape (rows,) or one number; inf where there is none.
        weight: Weight of a violation's square beside the tasks of the first level, positive; None forbids violations.

    Attributes:
        name: Name of the constraint.
        matrix: C; live.
        lower: Lower bounds; live.
        upper: Upper bounds; live.
        weight: Weight of a violation, or None.

    Raises:
        SizeMismatch: The shapes of the arrays do not fit.
        NotFinite: The matrix is not finite, or a bound is NaN.
        TaskError: A lower bound is above its upper one, or the weight is not positive.
    """

    def __init__(
        self,
        name: str,
        matrix: np.ndarray,
        lower: ArrayLike,
        upper: ArrayLike,
        weight: float | None = None,
    ):
        self.name = name
        self.weight = weight
        self.matrix = as_numbers(matrix, "matrix", self.where)
        self.lower, self.upper = (self._bounds(bounds) for bounds in (lower, upper))
        if not np.isfinite(self.matrix).all() or np.isnan([self.lower, self.upper]).any():
            raise NotFinite("a matrix that is not finite, or a bound that is NaN", where=self.where)
        for row in np.flatnonzero(self.lower > self.upper):
            raise TaskError(
                f"row {row} has the lower bound {self.lower[row]:g} above the upper one {self.upper[row]:g}",
                where=self.where,
                expected="a lower bound that is not above the upper one",
            )
        if weight is not None and not 0.0 < weight < np.inf:
            raise TaskError(f"a weight of {weight:g}", where=self.where, expected="a positive number, or None")

    @property
    def where(self) -> str:
        """The constraint as a place of errors."""
        return f"constraint '{self.name}'"

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.matrix)

    def update(self) -> None:
        """Compute the arrays at the state of the last update of the Robot; here they stay as they are."""

    def _bounds(self, values: ArrayLike) -> np.ndarray:
        values = as_numbers(values, "bound", self.where)
        if self.matrix.ndim != 2 or values.shape not in ((), (self.rows,)):
            raise SizeMismatch(
                f"bounds of shape {values.shape} for a matrix of shape {self.matrix.shape}",
                where=self.where,
                expected="a matrix (rows, n), and one number or one a row",
            )
        return np.full(self.rows, values)


class TorqueLimits(Constraint):
    """Joint velocities that the drives can reach within one period.

    With the measured velocity v, the period T and the generalised force f of contacts, the torque
    M (dq - v) / T + h - f lies within the limits. Row k is divided by M_kk / T: bounds and violations are velocities.

    Args:
        model: The dynamics; inertia and bias are subscribed.
        period: Period T of the control cycle [s].
        limit: Largest torques [Nm, N], shape (n,), positive; inf where there is none. Default: those of the robot.
        weight: See `Constraint`. Limits below the torques that gravity needs cannot be kept.

    Attributes:
        force: Generalised force f of the contacts, shape (n,) [Nm, N]; live, zero until it is written.

    Raises:
        SizeMismatch: There is not one limit a DoF.
        TaskError: A limit or the period is not positive, or there is no limit at all.
    """

    def __init__(self, model: DynamicModel, period: float, limit: ArrayLike | None = None, weight: float | None = None):
        kinematics = model.robot.kinematics
        limit = np.array(kinematics.effort_limit if limit is None else limit, dtype=float)
        if limit.shape != (kinematics.size,):
            raise SizeMismatch(f"torque limits of shape {limit.shape} for {kinematics.size} DoFs")
        for dof in np.flatnonzero(~(limit > 0.0)):
            raise TaskError(
                f"a torque limit of {limit[dof]:g}",
                where=f"joint '{kinematics.dofs[dof]}'",
                expected="a positive number",
            )
        if not 0.0 < period < np.inf:
            raise TaskError(f"torque limits with a period of {period:g} s", expected="a positive number")
        self._dofs = np.flatnonzero(np.isfinite(limit))
        if not len(self._dofs):
            raise TaskError(
                f"no DoF of '{model.robot.name}' has a torque limit", expected="at least one DoF with a finite limit"
            )
        count = len(self._dofs)
        super().__init__("torques", np.zeros((count, kinematics.size)), -np.inf, upper=np.inf, weight=weight)
        self.force = np.zeros(kinematics.size)
        self._model = model
        self._period = period
        self._limit = limit[self._dofs]
        self._load = np.zeros(kinematics.size)
        self._scale = np.zeros(count)
        self._range = np.zeros(count)
        self._center = np.zeros(count)
        model.subscribe({BIAS: 1, INERTIA: 1})

    def update(self) -> None:
        """Compute the rows at the state of the last update of the Robot."""
        inertia = self._model.inertia
        velocity = self._model.robot.state.velocity
        inertia.take(self._dofs, 0, self.matrix, "clip")
        np.divide(self._period, inertia.diagonal()[self._dofs], out=self._scale)
        np.subtract(self.force, self._model.bias, out=self._load)
        np.dot(self.matrix, velocity, out=self._center)
        self._center /= self._period
        self._center += self._load[self._dofs]
        self._center *= self._scale
        np.multiply(self._limit, self._scale, out=self._range)
        np.subtract(self._center, self._range, out=self.lower)
        np.add(self._center, self._range, out=self.upper)
        self._scale /= self._period
        self.matrix *= self._scale[:, np.newaxis]


class WorkspaceLimit(Constraint):
    """A distance that stays between two others: the length of a vector x, such as from one link to another.

    The square of it is limited, which is smooth where the length is zero: the rate 2 x' J dq lies between
    (r^2 - x^2) / T and (R^2 - x^2) / T. Outside of its range the distance may come back and need not, so that zero
    velocity is always allowed.

    Args:
        name: Name of the constraint.
        point: The vector x of a Robot; its operands are updated along with it.
        nearest: Least length r, not negative [m].
        farthest: Largest length R, not below r [m].
        weight: See `Constraint`.

    Raises:
        TaskError: The point is no vector or moves with no robot, or the lengths contradict each other.
    """

    def __init__(self, name: str, point: Point, nearest: float, farthest: float, weight: float | None = None):
        if not point.space.is_vector or not point.cols:
            raise TaskError(f"{point}", where=f"constraint '{name}'", expected="a vector that moves with a robot")
        if not 0.0 <= nearest <= farthest:
            raise TaskError(
                f"a distance from {nearest:g} to {farthest:g} m", where=f"constraint '{name}'", expected="0 <= r <= R"
            )
        super().__init__(name, np.zeros((1, point.cols)), -np.inf, upper=np.inf, weight=weight)
        self._points = Handler(updated_in_order(point))
        self._point = point
        self._least = nearest**2
        self._largest = farthest**2
        self._rate = 0.0

    def set_horizon(self, horizon: float) -> None:
        """Set the time T within which the distance may reach the end of its range, not below the period [s].

        Raises:
            TaskError: It is not a positive number.
        """
        self._rate = 1.0 / require_positive(horizon, "a horizon", self.where)

    def update(self) -> None:
        """Compute the row at the state of the last update of the Robot."""
        self._points.update()
        self.lower[0], self.upper[0] = limit_square(
            self._point.value, self._point.jacobian, self._least, self._largest, self._rate, self.matrix
        )


def require_positive(value: float, what: str, where: str) -> float:
    """Return a positive number; a TaskError that calls it `what` if it is none."""
    if not 0.0 < value < np.inf:
        raise TaskError(f"{what} of {value:g} s", where=where, expected="a positive number")
    return value


def joint_bounds(robot: RobotView, horizon: float) -> VelocityBounds:
    """Make bounds from the position and velocity limits of the robot's joints; `horizon` [s] as in `VelocityBounds`."""
    kinematics = robot.kinematics
    return VelocityBounds(
        kinematics.dofs,
        kinematics.lower_position,
        kinematics.upper_position,
        speed=kinematics.velocity_limit,
        horizon=horizon,
    )
