"""Velocities that others send again and again, and what becomes of the motion when they cease."""

import logging

import numpy as np

from solfer.components.wheeled_motion.drive import Drive
from solfer.components.wheeled_motion.points import RollingOffsets
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.targets import PATIENCE, Targets
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class SentVelocities:
    """Lets the references move as others say; where these fall silent in the middle of a motion, it comes to rest.

    Then nobody wants the robot at a certain place. So the references are put where base and wheels have come to rest:
    what they were behind would let wheels steer and roll on.

    Args:
        name: Name of the component.
        drive: Velocities of the base.
        targets: Those of the vertices.
        references: What they move.
        offsets: The vertices.
        place: Where the base is; live, shape (3,) [m].
    """

    def __init__(
        self,
        name: str,
        drive: Drive,
        targets: Targets,
        references: References,
        offsets: RollingOffsets,
        place: np.ndarray,
    ):
        self._name, self._drive, self._targets = name, drive, targets
        self._references, self._offsets, self._place = references, offsets, place
        self._throttle = Throttle(log)

    @property
    def share(self) -> float:
        """Share of the velocities of others that is not larger than it may be: one of base and vertices."""
        return min(self._drive.share, self._targets.share)

    @property
    def are_abandoned(self) -> bool:
        """Whether the motion ends since no velocities come any more, though the last ones were to go on."""
        return self._drive.is_abandoned or self._targets.is_abandoned

    def update(self, passed: float) -> None:
        """Write the velocities of a cycle, `passed` [s] after the one before."""
        were_abandoned = self.are_abandoned
        if were_abandoned:
            self._throttle.warning("silence", "%s: no velocity for %.2f s, it comes to rest", self._name, PATIENCE)
        self._drive.update(self._references, self._offsets.heading, self.share, passed)
        self._targets.update(self._references, self.share, passed)
        if were_abandoned and not self.are_abandoned and not self._references.waits:
            self._references.stay(self._place, self._offsets.heading, self._offsets.states)
