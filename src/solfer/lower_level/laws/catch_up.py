"""Moves the springs' targets smoothly to positions that jump."""

import numpy as np

from solfer.lower_level.gains.ramp import ALL_JOINTS

LONGEST_PAUSE = 0.1
"""Longest time between two commands of one stream [s]; a later one is expected where the stream would be by then."""


class _Buffers:
    """What a step computes of each joint, shape (n,).

    Args:
        size: Number n of joints.
    """

    def __init__(self, size: int):
        self.moved, self.work, self.bound, self.time, self.change = (np.zeros(size) for _ in range(5))
        self.jumped = np.zeros(size, dtype=bool)


class CatchUp:
    """Distances between springs' targets and commanded positions, which fade out where those jump.

    A stream of commands is followed as it is. A position that is further than 0.01 rad or m from where the newest two
    commands were heading has jumped: the sender or the robot was stopped, or another sender begins elsewhere. Then the
    distance o between command and target fades out as o'' = -2 w o' - w^2 o, with w = 10 rad/s: 1 % is left after
    0.66 s. |o'| is at most 0.2 times the joint's speed limit, or what the stream leaves of 0.8 times it: links on
    springs swing beyond that. The target stays continuous in position and speed, and never overshoots the command.

    Args:
        speed_limit: Speed limit of each joint, shape (n,) [rad/s, m/s].

    Attributes:
        distance: o of each joint, shape (n,) [rad, m].
        active: Whether any of them is not zero.
    """

    def __init__(self, speed_limit: np.ndarray):
        size = len(speed_limit)
        self._fastest = 0.2 * speed_limit
        self._whole = 0.8 * speed_limit
        self.distance = np.zeros(size)
        self._rate = np.zeros(size)
        self._last = np.zeros(size)
        self._speed = np.zeros(size)
        self._age = np.full(size, LONGEST_PAUSE)
        self._limit = np.array(speed_limit, dtype=float)
        self._buffers = _Buffers(size)
        self._news = np.zeros(size, dtype=bool)
        self.active = self._any_news = False

    def start(self, position: np.ndarray, joints: np.ndarray | slice = ALL_JOINTS) -> None:
        """Start with commands and targets of `joints` at `position`, shape (n,)."""
        self._last[joints] = position[joints]
        for values in (self.distance, self._rate, self._speed):
            values[joints] = 0.0
        self._age[joints] = LONGEST_PAUSE
        self._news[joints] = False

    def fall_behind(self, joint: int, command: float, distance: float) -> None:
        """Let the target of a joint, an index, be at rest at a distance before its command [rad, m]."""
        self._last[joint] = command
        self.distance[joint] = distance
        self._rate[joint] = 0.0
        self.active = True

    def renew(self, indices: np.ndarray) -> None:
        """Mark the joints at `indices` as commanded again."""
        self._news[indices] = True
        self._any_news = True

    def advance(self, dt: float, position: np.ndarray) -> None:
        """Let `dt` [s] pass; `position` is the last command, shape (n,)."""
        self._age += dt
        if self._any_news:
            self._detect_jumps(position)
        if self.active:
            self._fade(dt)

    def _detect_jumps(self, position: np.ndarray) -> None:
        """Compare the command with where its stream was heading."""
        jump_distance = 0.01  # [rad, m]
        shortest_period = 0.005  # [s] below which that shrinks in proportion: an emptied queue is not a fast stream
        largest_acceleration = 50.0  # of the stream's estimated speed at a jump [rad/s2, m/s2]
        buffers = self._buffers
        moved = buffers.moved
        extra = buffers.work
        time = buffers.time
        news = self._news
        jumped = buffers.jumped
        np.minimum(self._age, LONGEST_PAUSE, out=time)
        np.subtract(position, self._last, out=moved)
        # at most the commanded part of the stream's own step: a sender that stood still goes on where it was
        np.multiply(self._speed, time, out=extra)
        np.minimum(extra, np.maximum(moved, 0.0, out=buffers.bound), out=extra)
        np.maximum(extra, np.minimum(moved, 0.0, out=buffers.bound), out=extra)
        np.subtract(moved, extra, out=extra)
        np.multiply(
            np.minimum(time, shortest_period, out=buffers.change), jump_distance / shortest_period, out=buffers.change
        )
        np.greater(np.abs(extra, out=buffers.bound), buffers.change, out=jumped)
        np.logical_and(jumped, news, out=jumped)
        if jumped.any():
            np.add(self.distance, extra, out=self.distance, where=jumped)
            self.active = True
        # the stream's speed; at a jump its change is bounded
        np.multiply(time, largest_acceleration, out=buffers.change)
        np.copyto(buffers.change, np.inf, where=np.logical_not(jumped, out=jumped))
        np.divide(moved, time, out=moved, where=news)
        np.subtract(moved, self._speed, out=moved)
        np.minimum(moved, buffers.change, out=moved)
        np.maximum(moved, np.negative(buffers.change, out=buffers.change), out=moved)
        np.add(self._speed, moved, out=self._speed, where=news)
        np.minimum(self._speed, self._limit, out=self._speed)
        np.maximum(self._speed, np.negative(self._limit, out=buffers.bound), out=self._speed)
        np.copyto(self._last, position)
        np.copyto(self._age, 0.0, where=news)
        news.fill(False)
        self._any_news = False

    def _fade(self, dt: float) -> None:
        """Fade for one step, implicit in the speed."""
        frequency = 10.0  # w [rad/s]
        caught_up = 1e-6  # distance and speed below which a joint has caught up [rad, rad/s]
        distance = self.distance
        rate = self._rate
        buffers = self._buffers
        work = buffers.work
        np.multiply(distance, -frequency * frequency * dt, out=work)
        rate += work
        rate /= 1.0 + 2.0 * frequency * dt
        # the target moves at the speed of its stream, if that goes on, minus the rate of the distance
        speed = buffers.moved
        bound = buffers.bound
        np.less(self._age, LONGEST_PAUSE, out=buffers.jumped)
        np.multiply(self._speed, buffers.jumped, out=speed)
        np.minimum(np.add(speed, self._whole, out=bound), self._fastest, out=bound)
        np.minimum(rate, np.maximum(bound, 0.0, out=bound), out=rate)
        np.minimum(np.subtract(self._whole, speed, out=bound), self._fastest, out=bound)
        np.negative(np.maximum(bound, 0.0, out=bound), out=bound)
        np.maximum(rate, bound, out=rate)
        np.multiply(rate, dt, out=work)
        distance += work
        np.abs(distance, out=work)
        if work.max() < caught_up and np.abs(rate, out=work).max() < caught_up:
            distance.fill(0.0)
            rate.fill(0.0)
            self.active = False
