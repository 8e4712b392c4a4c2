"""How fast a scenario may be played: at rest where its velocities jump, which no robot can follow."""

import math
from collections import deque

import numpy as np

from solfer_tools.scenarios import Player, Scenario

FADE_TIME = 1.0
"""Time in which the pace goes from 1 to 0 before a jump, and back after it [s]."""


class Lookahead:
    """Sees the jumps of a scenario before they come, and slows it down so that it comes nearly to rest there.

    Without that base and vertices would follow a jump with the accelerations of the robot: off the path of the file,
    and, where wheels have to turn first, by less way than they would go on when they brake.

    Args:
        scenario: What is played.
    """

    def __init__(self, scenario: Scenario):
        self._ahead = Player(scenario)
        self._jumps = deque[float]()
        self._before = self._velocities()

    def max_pace(self, elapsed: float) -> float:
        """Return the largest pace at a time of the scenario [s], which never goes back."""
        while not self._ahead.is_over and self._ahead.elapsed <= elapsed + 0.5 * FADE_TIME:
            self._look()
        while self._jumps and self._jumps[0] <= elapsed:
            self._jumps.popleft()
        if not self._jumps:
            return 1.0
        lowest = 0.1  # at which a jump is passed
        return min(1.0, max(lowest, math.sqrt(2.0 * (self._jumps[0] - elapsed) / FADE_TIME)))

    def _look(self) -> None:
        """Go on by a period of the file."""
        begin = self._ahead.elapsed
        self._ahead.step()
        now = self._velocities()
        before = self._before
        self._before = now
        jumps = (0.02, 0.05, 0.02)  # smallest ones: of the base [m/s], of its heading [rad/s], of a vertex [m/s]
        if any(np.abs(new - old).max() > jump for new, old, jump in zip(now, before, jumps, strict=True)):
            self._jumps.append(begin)

    def _velocities(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        base = self._ahead.base_velocity
        return base[:3].copy(), base[3:].copy(), self._ahead.vertex_velocity.copy()
