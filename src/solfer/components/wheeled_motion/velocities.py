"""Velocities that others send again and again, and what becomes of the motion when they cease."""

import logging

from solfer.components.wheeled_motion.drive import Drive
from solfer.components.wheeled_motion.points import RollingOffsets
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.targets import PATIENCE, Targets
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class SentVelocities:
    """Lets the references move as others say; where these fall silent in the middle of a motion, it comes to rest.

    Args:
        name: Name of the component.
        drive: Velocities of the base.
        targets: Those of the vertices.
        references: What they move.
        offsets: The vertices.
    """

    def __init__(self, name: str, drive: Drive, targets: Targets, references: References, offsets: RollingOffsets):
        self._name = name
        self._drive = drive
        self._targets = targets
        self._references = references
        self._offsets = offsets
        self._throttle = Throttle(log)

    @property
    def share(self) -> float:
        """Share of the velocities of others that is not larger than it may be: one of base and vertices."""
        return min(self._drive.share, self._targets.share)

    @property
    def are_abandoned(self) -> bool:
        """Whether the motion ends since no velocities come any more, though the last ones were to go on."""
        return self._drive.is_abandoned or self._targets.is_abandoned

    def update(self, passed: float) -> bool:
        """Write the velocities of a cycle, `passed` [s] after the one before.

        Returns:
            Whether a motion that was abandoned has come to rest in this cycle.
        """
        were_abandoned = self.are_abandoned
        if were_abandoned:
            what = "position" if self._targets.are_places_abandoned else "velocity"
            self._throttle.warning("silence", "%s: no %s for %.2f s, it comes to rest", self._name, what, PATIENCE)
        self._drive.update(self._references, self._offsets.heading, self.share, passed)
        self._targets.update(self._references, self.share, passed)
        return were_abandoned and not self.are_abandoned and not self._references.waits
