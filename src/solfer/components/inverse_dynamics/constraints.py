"""What the QP of an inverse dynamics bounds besides its unknowns, by name."""

import numpy as np

from solfer.components.inverse_dynamics.ground import Ground
from solfer.components.inverse_dynamics.kernel import touch
from solfer.numerics.bounds.acceleration import AccelerationBounds
from solfer.robot import Robot


class ProblemConstraints:
    """The constraints of the QP in the order of their names, and which of them the last solution touches.

    Args:
        robot: The Robot.
        ground: Its contacts.
        bounds: Bounds of the accelerations of all DoFs.
        driven: DoFs with a drive, shape (m,).
        torque_limits: Largest torques of all DoFs, inf where there is none, shape (n,) [Nm, N].

    Attributes:
        names: Names of the constraints, see `WholeBodyProblem`.
        active: 1 for each that is at a limit, else 0, shape (c,); live.
        driven: See above.
        limits: Largest torques of these, shape (m,) [Nm, N]; live.
        lower, values, upper: Bounds, and what they bound, shape (c,) each; live.
        count: Number of those of torques, friction and normal forces, which come before those of accelerations.
    """

    def __init__(
        self, robot: Robot, ground: Ground, bounds: AccelerationBounds, driven: np.ndarray, torque_limits: np.ndarray
    ):
        self._ground = ground
        self._bounds = bounds
        self.driven = driven
        self.limits = np.zeros(len(driven))
        self.names = (
            *(f"torque of {robot.dofs[dof]}" for dof in driven),
            *(f"friction of {ground.names[owner]}" for owner in ground.cones.owners),
            *(f"normal force of {name}" for name in ground.names),
            *(f"acceleration of {dof}" for dof in robot.dofs),
        )
        self.active = np.zeros(len(self.names), dtype=np.int64)
        self.values, self.lower, self.upper = np.zeros((3, len(self.names)))
        self._cones = len(driven) + len(ground.cones.matrix)
        self.count = self._cones + len(ground.normals)
        self.lower[len(driven) : self._cones] = -np.inf
        self.limit_torques(torque_limits)

    def limit_torques(self, limits: np.ndarray) -> None:
        """Set the largest torques of all DoFs, shape (n,) [Nm, N]."""
        drives = len(self.driven)
        np.take(limits, self.driven, out=self.limits)
        np.negative(self.limits, out=self.lower[:drives])
        self.upper[:drives] = self.limits

    def compare(self, torque: np.ndarray, force: np.ndarray, acceleration: np.ndarray) -> None:
        """Write what is bounded in a solution, and which bounds it touches; see `WholeBodyProblem`."""
        values = self.values
        ground = self._ground
        drives = len(self.driven)
        cones = self._cones
        first = self.count
        np.take(torque, self.driven, out=values[:drives], mode="clip")
        np.dot(ground.cones.matrix, force, out=values[drives:cones])
        np.dot(ground.normals, force, out=values[cones:first])
        values[first:] = acceleration
        self.upper[cones:first] = ground.largest
        self.lower[first:], self.upper[first:] = self._bounds.lower, self._bounds.upper
        # within a millionth of a limit, or of 1
        touch(values, self.lower, self.upper, 1e-6, self.active)

    def farthest(self) -> str:
        """Return the name of the constraint that is violated most; empty where a value is not finite."""
        if not np.isfinite(self.values).all():
            return ""
        return self.names[int(np.argmax(np.maximum(self.lower - self.values, self.values - self.upper)))]
