"""The table of the kinds of pipes, as far as a configuration has to know them; `pipes.kinds` builds on it."""

from importlib import import_module
from typing import Any

from solfer.config.records.pipes import HOMES, ControllerRecord, FeedbackRecord, KindRecords, PipeRecord

KINDS: dict[str, KindRecords] = {
    space: import_module(f"solfer.config.kinds.{home}").RECORDS for space, home in HOMES.items()
}
"""Records of each kind, by its `space`."""


def record_of(record: type[PipeRecord], space: object) -> type[Any]:
    """Return the record of a pipe of a `space`, for FeedbackRecord or ControllerRecord.

    Where the space is not known, that is `record` itself, which refuses it.
    """
    kind = KINDS.get(space) if isinstance(space, str) else None
    if kind is None and space is None and issubclass(record, ControllerRecord):
        kind = KINDS[record.model_fields["space"].default]
    if kind is None:
        return record
    return kind.feedback if issubclass(record, FeedbackRecord) else kind.controller
