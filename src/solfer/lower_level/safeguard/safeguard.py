"""Detects a robot that is out of control, independent of its commands."""

import logging

import numpy as np

from solfer.lower_level.records import LowerLevelRecord
from solfer.lower_level.safeguard.overspeed import Overspeed
from solfer.lower_level.safeguard.tilt import Tilt
from solfer.model.kinematics import Kinematics

logger = logging.getLogger(__name__)


class Safeguard:
    """Checks tilt and speeds in each step; while one of them is out of bounds, no command is accepted.

    Args:
        kinematics: Model of the robot.
        record: The bounds.
    """

    def __init__(self, kinematics: Kinematics, record: LowerLevelRecord):
        self._tilt = Tilt(kinematics, record.tilt, record.tilt_time)
        self._overspeed = Overspeed(kinematics, record.overspeed, record.overspeed_time)

    @property
    def reason(self) -> str:
        """Why the robot has to hold; empty while all is well."""
        return self._tilt.reason or self._overspeed.reason

    @property
    def expected(self) -> str:
        """Description of the state that ends the hold, for errors."""
        if self._tilt.reason:
            return "a robot that stands upright: lift it, or put it into another state"
        return "a moment in which all joints are within their speed limits"

    def restart(self, q: np.ndarray) -> None:
        """Forget the past: the robot begins again at q, shape (model size,)."""
        self._overspeed.restart()
        self._tilt.restart(q)

    def advance(self, q: np.ndarray, v: np.ndarray, dt: float) -> str:
        """Let `dt` [s] pass at q, v, shape (model size,); return the fault found in this step, empty for none."""
        before = self.reason
        fallen = self._tilt.advance(q, dt)
        fast = self._overspeed.advance(v, dt, self._tilt.changes)
        if fallen:
            return self._tilt.reason
        if fast:
            return self._overspeed.reason
        if before and not self.reason:
            logger.warning("the robot may be commanded again; it was held: %s", before)
        return ""
