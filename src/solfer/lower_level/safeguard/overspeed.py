"""Detects joints that move faster than any command allows."""

import numpy as np

from solfer.model.kinematics import Kinematics


class Overspeed:
    """Detects a joint that has moved beyond a multiple of its speed limit for too long.

    Time beyond counts up, time within counts down, so that a joint that swings wildly is detected as well, but not the
    effect of a contact for a few steps. Joints without a limit, or with a limit of zero, are left out.

    Args:
        kinematics: Model of the robot.
        factor: The multiple; 0: no such bound.
        time: How long a joint has to be beyond it [s].

    Attributes:
        reason: Why the robot has to hold; empty while all joints are within their bounds.
    """

    def __init__(self, kinematics: Kinematics, factor: float, time: float):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import inside

        self.reason = ""
        self._factor = factor
        self._time = time
        self._joints = kinematics.dofs
        self._calm = 0.0
        self._units = [
            "m/s" if joint is not None and joint.type == "prismatic" else "rad/s"
            for joint in map(kinematics.description.joints.get, kinematics.dofs)
        ]
        limit = kinematics.velocity_limit
        self._limit = np.where(limit > 0.0, limit, np.inf)  # also that of a floating base
        bound = factor * self._limit if factor > 0.0 else np.full_like(limit, np.inf)
        self._bounds = -bound, bound
        self._enabled = bool(np.isfinite(bound).any())
        self._inside = inside
        self._speed, self._age, self._change = (np.zeros_like(limit) for _ in range(3))
        self._beyond = np.zeros(limit.shape, dtype=bool)
        self._counts = False

    def restart(self) -> None:
        """Forget the past: the robot begins again."""
        self.reason = ""
        self._calm = 0.0
        self._counts = False
        self._age[:] = 0.0

    def advance(self, v: np.ndarray, dt: float, stay: bool = False) -> bool:
        """Let time pass.

        Args:
            v: Velocities of the DoFs, shape (model size,).
            dt: The time [s].
            stay: Whether `reason` stays, however slow the joints are.

        Returns:
            Whether a joint was found too fast in this step.
        """
        if not self._enabled:
            return False
        if not self._counts and not self.reason and self._inside(v, *self._bounds):
            return False
        np.absolute(v, out=self._speed)
        if self.reason:
            self._settle(dt, stay)
            return False
        np.greater(self._speed, self._bounds[1], out=self._beyond)
        return self._count(dt)

    def _count(self, dt: float) -> bool:
        """Count the time of each joint beyond its bound up, or down; return whether one was beyond for too long."""
        age = self._age
        np.multiply(self._beyond, 2.0 * dt, out=self._change)
        np.add(age, self._change, out=age)
        np.subtract(age, dt, out=age)
        np.maximum(age, 0.0, out=age)
        self._counts = bool(age.any())
        worst = int(age.argmax())
        if age[worst] <= self._time:
            return False
        self.restart()
        self.reason = (
            f"joint '{self._joints[worst]}' moved at {self._speed[worst]:.4g} {self._units[worst]}, beyond "
            f"{self._factor:g} times its limit of {self._limit[worst]:.4g}"
        )
        return True

    def _settle(self, dt: float, stay: bool) -> None:
        """Clear `reason` when all joints have been within their limits for 0.1 s."""
        np.greater(self._speed, self._limit, out=self._beyond)
        self._calm = 0.0 if self._beyond.any() else self._calm + dt
        if self._calm > 0.1 and not stay:
            self.restart()
