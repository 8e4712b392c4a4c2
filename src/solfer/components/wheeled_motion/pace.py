"""How fast a motion goes along its path: no faster than wheels and joints can follow."""

import math

import numpy as np

from solfer.components.wheeled_motion.steering import Steering

SIDEWAYS = 3e-3
"""Speed across a wheel with which its vertex may leave its way [m/s]."""

LACK = 1e-3
"""What velocities may lack of what is wanted, where joints are at their bounds [m/s, rad/s]."""

SLOWER, FASTER = 8.0, 1.0
"""How fast the pace falls and rises where joints are at their bounds [1/s]."""


class PathPace:
    """The share of all wanted velocities that goes on, from 0 to 1.

    A wheel that does not point to where it aims leaves its way with the speed v |sin d|, with the speed v that is
    wanted of its vertex and the angle d between both: the pace keeps it below SIDEWAYS. It also falls as long as joints
    at their bounds leave base or vertices slower than they are wanted. Speeds along the path change no faster than
    `acceleration`, and fall four times as fast.

    Args:
        acceleration: Largest change of a vertex' speed by the pace [m/s2].
        period: Period of the control cycle [s].

    Attributes:
        value: The pace.
    """

    def __init__(self, acceleration: float, period: float):
        self._step, self._period = acceleration * period, period
        self.start()

    def start(self) -> None:
        """Begin without a motion, which could go on in full."""
        self.value = self._bound = 1.0

    def update(self, steering: Steering, angles: np.ndarray, heading: float, lack: float) -> float:
        """Compute and return the pace of this cycle.

        Args:
            steering: Where wheels aim, and how fast they are wanted.
            angles: Directions of the wheels in the world, shape (m,) [rad].
            heading: Heading of the base [rad].
            lack: How much slower than wanted base or vertices are, because of joints at their bounds [m/s, rad/s].
        """
        fastest, across = 0.0, SIDEWAYS
        for speed, aim, angle in zip(steering.speeds.tolist(), steering.aims.tolist(), angles.tolist(), strict=True):
            fastest = max(fastest, speed)
            across = max(across, speed * abs(math.sin(aim - angle + heading)))
        change = (-SLOWER if lack > LACK else FASTER) * self._period
        self._bound = min(max(self._bound + change, 0.0), 1.0)
        wanted = min(SIDEWAYS / across, self._bound)
        if fastest > 0.0:
            step = self._step / fastest
            # it falls faster: the wheel leaves its way meanwhile
            wanted = min(max(wanted, self.value - 4.0 * step), self.value + step)
        self.value = wanted
        return wanted
