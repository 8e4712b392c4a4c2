"""Records of pipes that carry the state of a rigid body (Table 1, row 5 of the paper)."""

from typing import ClassVar

from solfer.config.records.pipes import LOWER_LEVEL_LAYERS, Content, ControllerRecord, FeedbackRecord, KindRecords

ODOMETRY = "nav_msgs/Odometry"
"""Message of the whole state of a rigid body."""

IMU_TOPIC = "imu"
"""Topic of the lower level's inertial measurements."""

CONTENT = Content(body=True, measures=True, online={"state": IMU_TOPIC})


class BodyFeedbackRecord(FeedbackRecord):
    """A link that a plugin receives: the floating base of a State."""

    content: ClassVar[Content] = CONTENT

    @property
    def default_message(self) -> str:
        """See `PipeRecord.default_message`."""
        inertial = self.reads_sensor or (self.layer in LOWER_LEVEL_LAYERS and self.source == IMU_TOPIC)
        return "sensor_msgs/Imu" if inertial else ODOMETRY

    @property
    def measured_link(self) -> str | None:
        """See `FeedbackRecord.measured_link`."""
        return self.sensor if self.reads_sensor else self.dofs.name

    @property
    def refers_to(self) -> str:
        """See `PipeRecord.refers_to`."""
        return f"link {self.measured_link}"


class BodyControllerRecord(ControllerRecord):
    """A link that a plugin publishes."""

    content: ClassVar[Content] = CONTENT

    @property
    def default_message(self) -> str:
        """See `PipeRecord.default_message`."""
        return ODOMETRY

    @property
    def refers_to(self) -> str:
        """See `PipeRecord.refers_to`."""
        return f"link {self.dofs.name}"


RECORDS = KindRecords(BodyFeedbackRecord, BodyControllerRecord)
