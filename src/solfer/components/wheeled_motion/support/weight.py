"""The base moves over its wheels, so that others carry its weight."""

import math

import numpy as np

from solfer.components.wheeled_motion.joints import CommandedJoints
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.numerics.planar_move import PlanarMove, seen_from, turned

SHIFT_SPEED = 0.06
"""Largest speed of the base where it shifts the weight [m/s]."""

SHIFT_ACCELERATION = 0.12
"""Largest acceleration of the base there [m/s2]."""


class WeightShift:
    """Moves the base while the vertices stay where they are, and back again.

    Args:
        references: What is desired of both.
        wheels: The wheels.
        joints: What is commanded.

    Attributes:
        goal: Where the base goes, or went, x and y in the world, shape (2,) [m].
    """

    def __init__(self, references: References, wheels: DrivenWheels, joints: CommandedJoints):
        self._references = references
        self._wheels = wheels
        self._joints = joints
        self.goal, self._shift, self._moved = np.zeros((3, 2))
        self._speed = 0.0

    def start(self) -> None:
        """Begin with the weight where it is."""
        self._shift[:] = 0.0
        self._moved[:] = 0.0

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped."""
        move.move(self.goal)

    def begin(self, x: float, y: float) -> None:
        """Let the base move by a displacement in the world [m]."""
        position = self._references.position
        self.goal[:] = position[0] + x, position[1] + y
        self._shift += self._seen(np.array((x, y)))
        self._speed = 0.0

    def give_up(self) -> None:
        """Let the base stay where it has come to: the rest of the path is given up."""
        self._shift += self._seen(self._references.position[:2] - self.goal)

    def begin_back(self) -> None:
        """Let the base move back by all displacements so far."""
        x, y = turned(self._references.heading, *self._shift.tolist())
        self.begin(-x, -y)

    def end(self, vertices: np.ndarray | None = None) -> None:
        """Let vertices be desired where they were before, or where `vertices` are, shape (k, 3) [m]."""
        if vertices is None:
            self._references.vertices[:, :2] += self._moved
        else:
            self._references.vertices[:, :2] = vertices[:, :2]
        self.start()

    def keep_places(self, period: float) -> None:
        """Let vertices stay where they are for a time [s], as fast as the base was commanded to move last."""
        references = self._references
        velocity = self._wheels.pose.jacobian[:2] @ self._joints.velocity
        back = self._seen(velocity) / max(references.pace, 0.05)
        references.vertex_velocity[:, :2] = -back
        self._moved += period * references.pace * back

    def go(self, period: float) -> bool:
        """Let the base move towards its goal for a time [s]; True when it is there."""
        references = self._references
        left = self.goal - references.position[:2]
        distance = math.hypot(*left)
        if distance < 1e-6:
            return True
        step = SHIFT_ACCELERATION * period
        self._speed = min(
            SHIFT_SPEED,
            self._speed + step,
            max(step, math.sqrt(2.0 * SHIFT_ACCELERATION * distance) - step),
        )
        speed = min(self._speed, distance / period)
        references.velocity[:2] = left * (speed / distance)
        return False

    def _seen(self, shift: np.ndarray) -> np.ndarray:
        """Return a displacement in the world as seen from the heading [m]."""
        return np.array(seen_from(self._references.heading, *shift.tolist()))
