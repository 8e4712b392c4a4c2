"""Detects a robot that has fallen."""

import math

import numpy as np

from solfer.model.kinematics import Kinematics


class Tilt:
    """Detects a base that has been tilted too far for too long.

    The tilt is the angle between the base's z axis, upwards where the robot stands, and the vertical. It includes the
    slope of the ground, but not the heading. A fixed base does not tilt.

    Args:
        kinematics: Model of the robot.
        largest: Largest tilt [rad]; 0: any.
        time: How long it has to be beyond that, and upright again before it counts as upright [s].

    Attributes:
        reason: Why the robot has to hold; empty while it stands.
    """

    def __init__(self, kinematics: Kinematics, largest: float, time: float):
        self.reason = ""
        self._largest = largest
        self._time = time
        self._age = 0.0
        self._enabled = kinematics.base is not None and largest > 0.0
        self._vertical = kinematics.base.rotation[2].tolist() if self._enabled else []
        self._fallen = math.cos(largest)
        self._righted = math.cos(0.8 * largest)  # below this tilt a robot that has fallen stands upright again

    @property
    def changes(self) -> bool:
        """Whether the tilt has crossed its bound, but not yet for long enough to change `reason`."""
        return self._age > 0.0

    def restart(self, q: np.ndarray) -> None:
        """Begin again at q, shape (model size,): whether the robot lies is decided at once."""
        self.reason = ""
        self._age = 0.0
        if self._enabled and (cosine := self._cosine(q)) < self._fallen:
            self._fall(cosine)

    def advance(self, q: np.ndarray, dt: float) -> bool:
        """Let `dt` [s] pass with the robot at q, shape (model size,).

        Returns:
            Whether it was found fallen in this step.
        """
        if not self._enabled:
            return False
        cosine = self._cosine(q)
        lay = bool(self.reason)
        lies = cosine < (self._righted if lay else self._fallen)
        self._age = self._age + dt if lies is not lay else 0.0
        if self._age <= self._time:
            return False
        self._age = 0.0
        if lies:
            self._fall(cosine)
        else:
            self.reason = ""
        return lies

    def _cosine(self, q: np.ndarray) -> float:
        """Compute the tilt's cosine: third entry of R_o Rx(rx) Ry(ry) Rz(rz) e_z, with R_o of the chart's origin."""
        rx = q.item(3)
        ry = q.item(4)
        x, y, z = self._vertical
        return x * math.sin(ry) + math.cos(ry) * (z * math.cos(rx) - y * math.sin(rx))

    def _fall(self, cosine: float) -> None:
        tilt = math.acos(min(1.0, max(-1.0, cosine)))
        self.reason = (
            f"the robot has fallen: its base is tilted by {math.degrees(tilt):.0f} degrees, beyond "
            f"{math.degrees(self._largest):.0f} degrees"
        )
