"""A localisation that corrects where the odometry's frame is."""

import math

import numpy as np

from solfer_tools.navigation.course import CORRECTION_TIME


class Correction:
    """A localisation that moves the odometry's frame to and fro in the map: at 1 Hz, by up to 10 cm and 3 degrees.

    Args:
        bus: Whose clock counts.
        seed: Seed of what is drawn.

    Attributes:
        drawn: By how much the odometry's frame is off in each second, shape (1000, 3): x, y [m] and heading [rad].
        missing: Why it is not known where that frame is; empty: it is.
    """

    def __init__(self, bus, seed):
        random = np.random.default_rng(seed)
        self.drawn = random.uniform(-1.0, 1.0, (1000, 3)) * (0.1, 0.1, math.radians(3.0))
        self.bus, self.missing = bus, ""

    def locate(self, frame):
        """See `Localisation.locate`."""
        assert frame == "odom"
        return self.missing or tuple(self.drawn[int(self.bus.time)] + (2.0, 1.0, 0.5))

    def pose(self, base, time):
        """Return where a base is in the map at a time [s]: x, y [m] and heading [rad]."""
        x, y, turn = self.drawn[int(time)] + (2.0, 1.0, 0.5)
        cos, sin = math.cos(turn), math.sin(turn)
        return x + cos * base[0] - sin * base[1], y + sin * base[0] + cos * base[1], turn + base[2]

    def mean_pose(self, base):
        """Return the mean of these poses, by the time constant with which they are followed."""
        ages = np.arange(0.0, 6.0 * CORRECTION_TIME, 0.1)
        poses = [self.pose(base, self.bus.time - age) for age in ages]
        return np.average(poses, axis=0, weights=np.exp(-ages / CORRECTION_TIME))
