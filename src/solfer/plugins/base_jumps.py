"""Finds jumps of the base's estimate, which no motion of the robot explains."""

import logging
import math

import numpy as np

from solfer.config.records.modules import BaseJumpRecord
from solfer.numerics.planar_move import PlanarMove
from solfer.robot import Robot
from solfer.throttle import Throttle

logger = logging.getLogger(__name__)


class BaseJumps:
    """Compares the base's pose with that of the cycle before.

    It has jumped where it is farther away than it can have moved since the estimate changed last: by the margin, and
    the largest speed for that time.

    Args:
        plugin: Name of the plugin, for messages.
        robot: The Robot, with a floating base.
        limits: What counts as a jump.

    Attributes:
        count: Jumps so far.
    """

    def __init__(self, plugin: str, robot: Robot, limits: BaseJumpRecord):
        self._plugin = plugin
        self._chart = robot.kinematics.base
        self._base = robot.state.position[:6]
        self._limits = limits
        self._throttle = Throttle(logger)
        self.count = 0
        self.restart()

    def restart(self) -> None:
        """Begin with where the base is now."""
        self._last = self._base.tolist()
        self._elapsed = 0.0

    def find(self, passed: float) -> PlanarMove | None:
        """Return how the base has jumped since the cycle before, which was `passed` [s] ago; None: it has not."""
        self._elapsed += passed
        base = self._base.tolist()
        last = self._last
        if base == last:
            return None
        limits = self._limits
        elapsed = self._elapsed
        self._last = base
        self._elapsed = 0.0
        distance = math.dist(base[:3], last[:3])
        rx, ry, rz = last[3:]
        angle = max(
            abs(math.remainder(base[3] - rx, 2.0 * math.pi)),
            abs(base[4] - ry),
            abs(math.remainder(base[5] - rz, 2.0 * math.pi)),
        )
        if distance <= limits.distance + limits.speed * elapsed and angle <= limits.angle + limits.turn_speed * elapsed:
            return None
        self.count += 1
        before = np.array(last)
        after = np.array(base)
        place, _ = self._chart.to_pose(before)
        new_place, _ = self._chart.to_pose(after)
        rotation = self._chart.to_rotation(after) @ self._chart.to_rotation(before).T
        turn = math.atan2(rotation[1, 0] - rotation[0, 1], rotation[0, 0] + rotation[1, 1])
        move = PlanarMove(place, new_place, turn)
        self._throttle.warning(
            "jump",
            "%s: the estimate of the base has jumped by %.3f m and %.1f degrees; references in the world move with it",
            self._plugin,
            move.distance,
            math.degrees(turn),
        )
        return move
