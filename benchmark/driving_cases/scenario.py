"""Scenario files as courses."""

import math
from typing import NamedTuple

import numpy as np

from solfer.components.wheeled_motion.references import References
from solfer.scenarios import Player, Scenario


class Goal(NamedTuple):
    """How far base and vertices have to be from where they began.

    Attributes:
        base: x, y, z [m] and heading [rad], seen from the heading at the begin, shape (4,).
        vertices: Seen from the heading of the base, shape (4, 3) [m].
    """

    base: np.ndarray
    vertices: np.ndarray


class ScenarioProfile:
    """Velocities of a scenario, from where the robot is; see `Profile` for what it offers.

    Absolute files are played by their differences, as the player's velocities are.

    Args:
        scenario: The scenario.
        period: Time of a cycle [s].
    """

    def __init__(self, scenario: Scenario, period: float):
        self._player, self._period = Player(scenario, period), period
        self.duration, self.grounded, self.is_over = scenario.duration, self._player.grounded, False
        self._cos, self._sin = 1.0, 0.0

    def begin(self, references: References) -> None:
        """Let the file's x be the direction in which the robot looks."""
        self._cos, self._sin = math.cos(references.heading), math.sin(references.heading)

    def step(self, pace: float = 1.0) -> None:
        """Go on for a cycle, of whose time a share `pace` counts for the scenario."""
        if pace > 0.0:
            self.is_over = not self._player.step(pace * self._period)

    def write(self, references: References) -> None:
        """Write the velocities of this cycle, and the camber."""
        player = self._player
        x, y, z, turn = player.base_velocity.tolist()
        references.velocity[:] = self._cos * x - self._sin * y, self._sin * x + self._cos * y, z
        references.turn[2] = turn
        references.vertex_velocity[:] = player.vertex_velocity
        references.camber[:] = player.camber

    @property
    def goal(self) -> Goal:
        """Where the file itself has come to."""
        player, scenario = self._player, self._player.scenario
        base = player.base - scenario.base + player.elapsed * scenario.constant
        return Goal(base, player.vertices - scenario.vertices)
