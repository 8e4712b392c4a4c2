"""What moves in a scenario: references of base and vertices, open loop, as the original's script has them."""

import math

import numpy as np

from solfer_tools.scenarios.scenario import Scenario

LOWEST_SPEED = 1e-3
"""Speed of a vertex below which it goes what is left in one period [m/s]."""

LAST_STEP = 1e-3
"""What is left of the base's way below which it goes there in one period [m, rad]."""

HEADING_INDEX = 3
"""Index of the heading among the numbers of the base."""


class Script:
    """References of a scenario and their velocities.

    Args:
        scenario: The scenario.

    Attributes:
        period: Time of a step [s].
        vertices: Vertices seen from the base's heading, shape (n, 3) [m].
        base: x, y, z [m] and heading [rad] of the base, shape (4,), without the constant velocity.
        vertex_velocity: Shape (n, 3) [m/s].
        base_velocity: Shape (4,) [m/s, rad/s], without the constant velocity.
        vertex_speed: Fraction of what is left that each vertex goes in a period, shape (n, 3).
        base_speed: Shape (4,) [m/s, rad/s].
        camber: Camber of each leg, shape (n,) [rad].
        grounded: Which legs have contact with the ground, shape (n,).
    """

    def __init__(self, scenario: Scenario):
        self.period = scenario.period
        legs = scenario.legs
        self.vertices = scenario.vertices
        self.base = scenario.base
        self.vertex_velocity = np.zeros((legs, 3))
        self.base_velocity = np.zeros(4)
        self.vertex_speed = np.full((legs, 3), scenario.record.vel)
        self.base_speed = np.full(4, scenario.record.vel)
        self.camber = np.zeros(legs)
        self.grounded = np.ones(legs, dtype=bool)
        self._left = np.zeros((legs, 3))
        self._bare = np.zeros((legs, 3))
        self._slow = np.zeros((legs, 3), dtype=bool)
        self._base_left = np.zeros(4)
        self._base_bare = np.zeros(4)
        self._base_near = np.zeros(4, dtype=bool)

    def rest(self) -> None:
        """Set all velocities to zero."""
        self.vertex_velocity[:] = 0.0
        self.base_velocity[:] = 0.0

    def approach(self, goals: np.ndarray) -> None:
        """Let vertices approach goals, shape (n, 3) [m]: exponentially, and the end of the path in one period."""
        np.subtract(goals, self.vertices, out=self._left)
        np.divide(self._left, self.period, out=self._left)
        np.multiply(self._left, self.vertex_speed, out=self.vertex_velocity)
        np.abs(self.vertex_velocity, out=self._bare)
        np.less(self._bare, LOWEST_SPEED, out=self._slow)
        np.copyto(self.vertex_velocity, self._left, where=self._slow)

    def go(self, goal: np.ndarray) -> None:
        """Let each number of the base go to a goal, shape (4,) [m, rad], at its speed."""
        left = self._base_left
        np.subtract(goal, self.base, out=left)
        np.sign(left, out=self.base_velocity)
        np.multiply(self.base_velocity, self.base_speed, out=self.base_velocity)
        np.abs(left, out=self._base_bare)
        np.less(self._base_bare, LAST_STEP, out=self._base_near)
        np.divide(left, self.period, out=left)
        np.copyto(self.base_velocity, left, where=self._base_near)

    def turn(self, heading: float) -> float:
        """Let the heading go to `heading` [rad] at its speed, x, y and z not at all; return its rate [rad/s]."""
        left = heading - self.base[HEADING_INDEX]
        self.base_velocity[:] = 0.0
        rate = left / self.period if abs(left) < LAST_STEP else math.copysign(self.base_speed[HEADING_INDEX], left)
        self.base_velocity[HEADING_INDEX] = rate
        return rate

    def move(self) -> None:
        """Go on by one period with the velocities."""
        np.multiply(self.vertex_velocity, self.period, out=self._left)
        np.add(self.vertices, self._left, out=self.vertices)
        np.multiply(self.base_velocity, self.period, out=self._base_left)
        np.add(self.base, self._base_left, out=self.base)
