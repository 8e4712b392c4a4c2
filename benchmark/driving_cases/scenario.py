"""Scenario files as courses."""

import math
from typing import NamedTuple

import numpy as np

from solfer.components.wheeled_motion.references import References
from solfer_tools.scenarios import Player, Scenario


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

    Absolute files are played by their differences, as the player's velocities are. Velocities are means over two
    periods of the file: near goals that it does not meet its own change their sign with each.

    Args:
        scenario: The scenario.
        period: Time of a cycle [s].
    """

    def __init__(self, scenario: Scenario, period: float):
        self._player, self._period, self._time = Player(scenario, period), period, 0.0
        numbers, self._states = [np.zeros(4 + 3 * scenario.legs)], []
        while self._player.step():
            player = self._player
            numbers.append(np.concatenate((player.base_velocity, player.vertex_velocity.ravel())))
            self._states.append((player.grounded.copy(), player.camber.copy()))
        window = max(round(2.0 * scenario.period / period), 1)
        ways = np.cumsum(np.vstack((numbers, np.zeros((window, len(numbers[0]))))), axis=0) * period
        late = np.vstack((np.zeros((window, ways.shape[1])), ways[:-window]))
        self._ways = np.cumsum(ways - late, axis=0) / window
        self._velocity, self.duration, self.is_over = np.zeros(ways.shape[1]), scenario.duration, False
        self.grounded, self._camber = self._states[0]
        self._cos, self._sin = 1.0, 0.0

    def begin(self, references: References) -> None:
        """Let the file's x be the direction in which the robot looks."""
        self._cos, self._sin = math.cos(references.heading), math.sin(references.heading)

    def step(self, pace: float = 1.0) -> None:
        """Go on for a cycle, of whose time a share `pace` counts for the scenario."""
        if pace <= 0.0:
            return
        before, self._time = self._way(), self._time + pace
        self._velocity = (self._way() - before) / (pace * self._period)
        self.grounded, self._camber = self._states[min(int(self._time), len(self._states) - 1)]
        self.is_over = self._time >= len(self._ways) - 1

    def _way(self) -> np.ndarray:
        """Return how far base and vertices have gone until now."""
        index = min(int(self._time), len(self._ways) - 2)
        share = min(self._time - index, 1.0)
        return (1.0 - share) * self._ways[index] + share * self._ways[index + 1]

    def write(self, references: References) -> None:
        """Write the velocities of this cycle, and the camber."""
        x, y, z, turn = self._velocity[:4].tolist()
        references.velocity[:] = self._cos * x - self._sin * y, self._sin * x + self._cos * y, z
        references.angular[2] = turn
        references.vertex_velocity[:] = self._velocity[4:].reshape(references.vertex_velocity.shape)
        references.camber[:] = self._camber

    @property
    def goal(self) -> Goal:
        """Where the file itself comes to."""
        player, scenario = self._player, self._player.scenario
        base = player.base - scenario.base + player.elapsed * scenario.constant
        return Goal(base, player.vertices - scenario.vertices)
