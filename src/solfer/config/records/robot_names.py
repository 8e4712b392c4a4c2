"""Marks of fields that only rooms that know the robot can check: names of its parts, and sizes."""

import re
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

from pydantic.fields import FieldInfo

from solfer.config.records.record import Record
from solfer.config.yaml.nodes import Key, Mark


@dataclass(frozen=True)
class NameOf:
    """Marks the kind of a field's name: `chain: Annotated[str, NameOf("group")]`.

    Attributes:
        kind: Kind of the robot's part.
    """

    kind: Literal["group", "joint", "link", "state"]


Size = Literal["wheel", "radius", "tube", "ring", "world", "nothing", ""]


@dataclass(frozen=True)
class ComparedWith:
    """Marks what a number is compared with: `Annotated[float, ComparedWith("wheel")]`.

    Without a mark, the unit in the field's description says it: lengths are compared with the whole robot, speeds with
    its joints, gains and times with the control cycle.

    Attributes:
        size: `wheel`: the robot's wheels, of which it may be a part; `radius`: their whole radius; `tube`, `ring`: the
            radius of that part; `world`: distances that robots cover; `nothing`: any number can be meant; empty: as
            without a mark.
        usual: A usual number, where the field has no default.
        factor: How many times the default, or the usual number, it hardly is; zero: its unit says it.
    """

    size: Size = ""
    usual: float = 0.0
    factor: float = 0.0


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


@dataclass(frozen=True)
class WrittenNumber:
    """A number of a file.

    Attributes:
        mark: Its place.
        value: The number.
        units: The units that it may have, as in `[rad, m]`; empty: none is known.
        compared: What it is compared with.
        default: The default of its field, else a usual number; zero: it has none.
    """

    mark: Mark
    value: float
    units: tuple[str, ...]
    compared: ComparedWith
    default: float


def numbers_in(record: Record) -> Iterator[WrittenNumber]:
    """Yield all numbers with a fraction that a file gives to a record and to those below it."""
    for field, info in type(record).model_fields.items():
        if field in record.model_fields_set:
            unit, compared = record.unit_of(field)
            units = (unit,) if unit else tuple(re.findall(r"\[([^\]]+)\]", info.description or ""))
            mark = ComparedWith(typing.cast(Size, compared)) if compared else _compared_with(info)
            default = info.default if isinstance(info.default, float) else mark.usual
            yield from _numbers(
                record, (info.alias or field,), record.__dict__[field], units=units, compared=mark, default=default
            )


def _numbers(
    record: Record, path: tuple[Key, ...], value: Any, *, units: tuple[str, ...], compared: ComparedWith, default: float
) -> Iterator[WrittenNumber]:
    if isinstance(value, Record):
        yield from numbers_in(value)
    elif isinstance(value, dict | tuple):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers(record, (*path, key), item, units=units, compared=compared, default=default)
    elif isinstance(value, float):
        mark = record.place(*path)
        if mark is not None:
            yield WrittenNumber(mark, value, units, compared=compared, default=default)


def _compared_with(field: FieldInfo) -> ComparedWith:
    """Return the mark of a field, or of one of its types; an empty one if there is none."""
    marks = (*field.metadata, *_marks(field.annotation))
    return next((mark for mark in marks if isinstance(mark, ComparedWith)), ComparedWith())


def _marks(annotation: Any) -> Iterator[Any]:
    yield from getattr(annotation, "__metadata__", ())
    for part in typing.get_args(annotation):
        yield from _marks(part)
