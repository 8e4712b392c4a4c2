"""Makes a plugin that receives what was recorded, and works when the recorded one did."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from solfer.config import FeedbackRecord
from solfer.pipes import FeedbackPipe, PipeContext
from solfer.plugins.feedback_timeout import FeedbackTimeout
from solfer.plugins.generation.generator import Generator
from solfer.plugins.joint_claim import JointClaim
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.plugin import Plugin
from solfer.plugins.timing.limits import LOST
from solfer.plugins.timing.robot_time import RobotTime
from solfer.robot import Robot
from solfer_tools.replay.feedback import RecordedFeedbackPipe
from solfer_tools.replay.rows import RecordedRows


class RecordedClaim(JointClaim):
    """The joints are the plugin's in those cycles in which the recorded plugin ran.

    Attributes:
        ours: Whether they are, in the present cycle.
    """

    ours = False

    def granted(self) -> bool:
        """See `JointClaim.granted`."""
        return self.ours

    @property
    def reason(self) -> str:  # type: ignore[override]
        """See `JointClaim.reason`."""
        return "" if self.ours else "the recorded plugin did not run"

    @reason.setter
    def reason(self, reason: str) -> None:
        """Ignore any other reason: the recording decides."""


class RecordedTime(RobotTime):
    """The time that passed for the robot in each recorded cycle, which stamps that were not recorded may decide.

    Args:
        plugin: The replayed plugin.
        passed: Time since the cycle before, in each cycle [s], shape (T,).
        lost: The part of the clock's time that did not pass for the robot [s], shape (T,).

    Attributes:
        row: Index of the present cycle; to be set before each.
    """

    def __init__(self, plugin: Plugin, passed: np.ndarray, lost: np.ndarray):
        super().__init__(plugin.feedbacks, 1.0 / plugin.rate)
        self._rows = passed.tolist(), lost.tolist()
        self._overload = plugin.overload
        self.row = 0
        self.advance = self._recorded

    def _recorded(self, now: float, stamp: float, accepted: int) -> float:
        """See `RobotTime.advance`."""
        passed, lost = self._rows
        self.state[LOST] = lost[self.row]
        self._overload.advance(passed[self.row])
        return passed[self.row]


class ReplayGenerator(Generator):
    """Makes the plugin; a subclass derives from the generator of its component, too, see `replaying`."""

    rows: ClassVar[RecordedRows]

    def _feedback(self, record: FeedbackRecord, context: PipeContext) -> FeedbackPipe:
        pipe = super()._feedback(record, context)
        return RecordedFeedbackPipe(pipe, self.rows, context.robot, port=context.inputs.get(record.name))

    def make_claim(self, robot: Robot, watches: Sequence[FeedbackTimeout], outputs: Outputs) -> RecordedClaim:
        """See `Generator.make_claim`."""
        self.claim = RecordedClaim(self.configuration.module.name, outputs.commanding, self.middleware)
        return self.claim


def replaying(generator: type[Generator], recorded: RecordedRows) -> type[ReplayGenerator]:
    """Return a generator that makes the same plugin for a replay."""
    return type(f"Replayed{generator.__name__}", (ReplayGenerator, generator), {"rows": recorded})
