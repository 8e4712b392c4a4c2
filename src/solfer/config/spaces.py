"""Which record a pipe has, by its space."""

from solfer.config.contacts import ContactControllerRecord, ContactFeedbackRecord
from solfer.config.pipes import FeedbackRecord, PipeRecord
from solfer.config.points import PointControllerRecord, PointFeedbackRecord

FEEDBACKS: dict[object, type[PipeRecord]] = {
    **dict.fromkeys(("POINT", "POINTS"), PointFeedbackRecord),
    **dict.fromkeys(("CONTACT", "CONTACTS"), ContactFeedbackRecord),
}
"""Records of pipes in that carry no DoFs."""

CONTROLLERS: dict[object, type[PipeRecord]] = {
    **dict.fromkeys(("POINT", "POINTS"), PointControllerRecord),
    **dict.fromkeys(("CONTACT", "CONTACTS"), ContactControllerRecord),
}
"""Records of pipes out that carry no DoFs."""


def record_of(record: type[PipeRecord], space: object) -> type[PipeRecord]:
    """The record of a pipe of a `space`, for FeedbackRecord or ControllerRecord."""
    kinds = FEEDBACKS if issubclass(record, FeedbackRecord) else CONTROLLERS
    return kinds.get(space, record) if isinstance(space, str) else record
