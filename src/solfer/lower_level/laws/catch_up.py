"""Moves the springs' targets smoothly to positions that jump."""

import numpy as np

from solfer.lower_level.gains.ramp import ALL_JOINTS


class CatchUp:
    """Distances between springs' targets and commanded positions, which fade out where those jump.

    A stream of commands is followed as it is. A position that is further than 0.01 rad or m from where the newest two
    commands were heading has jumped: the sender or the robot was stopped, or another sender begins elsewhere. Then the
    distance o between command and target fades out as o'' = -2 w o' - w^2 o, with w = 10 rad/s: 1 % is left after
    0.66 s. |o'| is at most 0.2 times the joint's speed limit, or what the stream leaves of 0.8 times it: links on
    springs swing beyond that. The target stays continuous in position and speed, and never overshoots the command.

    Args:
        speed_limit: Speed limit of each joint, shape (n,) [rad/s, m/s].
        position: Commanded position of each joint, live, shape (n,) [rad, m].

    Attributes:
        block: The numbers of the compiled step.
    """

    def __init__(self, speed_limit: np.ndarray, position: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.lower_level.laws.controllers_kernel import CATCH_UP, LONGEST_PAUSE
        from solfer.numerics.blocks import MemoryBlock

        size = len(speed_limit)
        self._silent = LONGEST_PAUSE
        self._flags = np.zeros(2, dtype=bool)
        self._news = np.zeros(size, dtype=bool)
        self._position = position
        self._last, self._speed, self._age, self._distance, self._rate = np.zeros((5, size))
        self.block = MemoryBlock(
            CATCH_UP,
            count=size,
            flags=self._flags,
            news=self._news,
            position=position,
            last=self._last,
            speed=self._speed,
            age=self._age,
            distance=self._distance,
            rate=self._rate,
            limit=np.array(speed_limit, dtype=float),
        )
        self._age[:] = LONGEST_PAUSE

    def start(self, joints: np.ndarray | slice = ALL_JOINTS) -> None:
        """Start with the targets of `joints` where they are commanded."""
        self._last[joints] = self._position[joints]
        for values in (self._distance, self._rate, self._speed):
            values[joints] = 0.0
        self._age[joints] = self._silent
        self._news[joints] = False

    def fall_behind(self, joint: int, distance: float) -> None:
        """Let the target of a joint, an index, be at rest at a distance before its command [rad, m]."""
        self._last[joint] = self._position[joint]
        self._distance[joint] = distance
        self._rate[joint] = 0.0
        self._flags[0] = True

    def renew(self, indices: np.ndarray) -> None:
        """Mark the joints at `indices` as commanded again."""
        self._news[indices] = True
        self._flags[1] = True
