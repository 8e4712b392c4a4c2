"""Makes a plugin that receives what was recorded, and works when the recorded one did."""

from collections.abc import Sequence
from typing import ClassVar

from solfer.config import FeedbackRecord
from solfer.pipes import FeedbackPipe, PipeContext
from solfer.plugins.feedback_timeout import FeedbackTimeout
from solfer.plugins.generation.generator import Generator
from solfer.plugins.joint_claim import JointClaim
from solfer.plugins.outputs.outputs import Outputs
from solfer.replay.feedback import RecordedFeedbackPipe
from solfer.replay.rows import RecordedRows
from solfer.robot import Robot


class RecordedClaim(JointClaim):
    """The joints are the plugin's in those cycles in which the recorded plugin ran.

    Attributes:
        ours: Whether they are, in the present cycle.
    """

    ours = False

    def granted(self) -> bool:
        """See `JointClaim.granted`."""
        return self.ours

    def lost(self) -> bool:
        """See `JointClaim.lost`."""
        return not self.ours


class ReplayGenerator(Generator):
    """Makes the plugin; a subclass derives from the generator of its component, too, see `replaying`."""

    rows: ClassVar[RecordedRows]

    def _feedback(self, record: FeedbackRecord, context: PipeContext) -> FeedbackPipe:
        pipe = super()._feedback(record, context)
        return RecordedFeedbackPipe(pipe, self.rows, context.robot, context.inputs.get(record.name))

    def make_claim(self, robot: Robot, watches: Sequence[FeedbackTimeout], outputs: Outputs) -> RecordedClaim:
        """See `Generator.make_claim`."""
        self.claim = RecordedClaim(self.configuration.module.name, outputs.commanding, self.middleware)
        return self.claim


def replaying(generator: type[Generator], recorded: RecordedRows) -> type[ReplayGenerator]:
    """Return a generator that makes the same plugin for a replay."""
    return type(f"Replayed{generator.__name__}", (ReplayGenerator, generator), {"rows": recorded})
