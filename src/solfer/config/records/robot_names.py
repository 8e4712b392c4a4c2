"""Fields of records that name parts of a robot, so that rooms that know the robot can check them all."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from solfer.config.records.record import Record


@dataclass(frozen=True)
class NameOf:
    """Marks the kind of a field's name: `chain: Annotated[str, NameOf("group")]`.

    Attributes:
        kind: Kind of the robot's part.
    """

    kind: Literal["group", "joint", "link", "state"]


def names_in(record: Record) -> Iterator[tuple[Record, str, str, str]]:
    """Yield all names of parts of a robot that a file gives to a record: the record, key, kind, and the name.

    Defaults are left out: a component may name a group that not every robot has.
    """
    for field, info in type(record).model_fields.items():
        value = record.__dict__[field]
        kind = next((mark.kind for mark in info.metadata if isinstance(mark, NameOf)), "")
        # not by attribute: obsolete ones would warn
        if field not in record.model_fields_set:
            continue
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, Record):
                yield from names_in(item)
            elif kind and isinstance(item, str):
                yield record, info.alias or field, kind, item
