"""Records of pipes that carry numbers of joints (Table 1, rows 1 to 4 of the paper)."""

from typing import ClassVar

from solfer.config.records.pipes import (
    JOINT_COMMAND,
    LOWER_LEVEL_LAYERS,
    Content,
    ControllerRecord,
    FeedbackRecord,
    KindRecords,
)

CONTENT = Content(
    joints=True, measures=True, needed=("function",), online={"state": "joint_states", "motor": "motor_states"}
)


class JointFeedbackRecord(FeedbackRecord):
    """Joints that a plugin receives: DoFs of a State."""

    content: ClassVar[Content] = CONTENT

    @property
    def default_message(self) -> str:
        """See `PipeRecord.default_message`; the lower level publishes measurements."""
        measured = self.layer in LOWER_LEVEL_LAYERS or (self.layer is None and self.function != "reference")
        return "sensor_msgs/JointState" if measured and self.interface.measurable else JOINT_COMMAND


class JointCommandRecord(ControllerRecord):
    """Joints that a plugin publishes, or commands."""

    content: ClassVar[Content] = CONTENT


RECORDS = KindRecords(JointFeedbackRecord, JointCommandRecord)
