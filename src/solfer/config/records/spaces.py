"""Records of pipes, by their space."""

from typing import Any

from solfer.config.records.contacts import ContactControllerRecord, ContactFeedbackRecord
from solfer.config.records.pipes import FeedbackRecord, PipeRecord
from solfer.config.records.points import PointControllerRecord, PointFeedbackRecord

FEEDBACKS: dict[object, type[PipeRecord]] = {
    **dict.fromkeys(("POINT", "POINTS"), PointFeedbackRecord),
    **dict.fromkeys(("CONTACT", "CONTACTS"), ContactFeedbackRecord),
}
"""Records of feedback pipes that carry no DoFs."""

CONTROLLERS: dict[object, type[PipeRecord]] = {
    **dict.fromkeys(("POINT", "POINTS"), PointControllerRecord),
    **dict.fromkeys(("CONTACT", "CONTACTS"), ContactControllerRecord),
}
"""Records of controller pipes that carry no DoFs."""


def record_of(record: type[PipeRecord], space: object) -> type[Any]:
    """Return the record of a pipe of a `space`, for FeedbackRecord or ControllerRecord."""
    kinds = FEEDBACKS if issubclass(record, FeedbackRecord) else CONTROLLERS
    return kinds.get(space, record) if isinstance(space, str) else record
