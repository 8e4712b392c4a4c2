"""Drivers that count a continuous joint within a turn, on and on, or from any turn, and robots that have them."""

import math

import numpy as np
from support.recording.sine import Follower

FIRST, ROLL = 3.0, 1
"""Where the joint begins [rad], so that it crosses half a turn, and its place."""


def within(angle, begin=-math.pi):
    """Count an angle in [begin, begin + 2 pi)."""
    return begin + (angle - begin) % math.tau


DRIVERS = {
    "counts on": lambda angle: angle,
    "wraps": within,
    "begins at zero": lambda angle: within(angle, 0.0),
    "begins at another angle": lambda angle: within(angle, 3.1),
    "begins anywhere": lambda angle: angle + math.tau * float(np.random.default_rng(11).integers(-50, 50)),
    "begins far off": lambda angle: angle - math.tau * 41,
}


def driven(count):
    """Return a follower whose driver counts the continuous joint in its own way."""

    class Driven(Follower):
        """Joints that follow what they are sent.

        Attributes:
            follows: Whether they do.
        """

        def __init__(self, *args):
            super().__init__(*args)
            self.follows = True
            self.position[ROLL] = FIRST
            self.move()  # the component begins where the joints are

        def move(self):
            """See `Follower.move`."""
            dofs = [self.plugin.robot.dof(name) for name in ("shoulder", "roll")]
            if self.plugin.running and self.follows:
                way = self.plugin.robot.command.position[dofs] - self.position
                self.position += 0.2 * (way - math.tau * np.rint(way / math.tau))
            noisy = self.position + self._drawn.normal(0.0, 1e-3, 2)
            noisy[ROLL] = count(noisy[ROLL])
            self.fleet.publish(position=noisy, velocity=np.zeros(2))

    return Driven
