"""Tables of all tags of a configuration, made from the records that the loader checks with."""

import types
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from pydantic.fields import FieldInfo

from solfer.config.kinds.table import KINDS
from solfer.config.records.calibration import CalibrationRecord
from solfer.config.records.live import bounds_of, is_live
from solfer.config.records.middlewares import SECTIONS
from solfer.config.records.modules import MainRecord, ModuleRecord, RobotHead, RobotRecord, SharedRecord
from solfer.config.records.pipes import ControllerRecord, FeedbackRecord, KindRecords
from solfer.config.records.record import Record
from solfer.config.records.rt_layer import ExecutorRecord, RtPluginsRecord
from solfer.config.records.sources import FileRecord, MappingRecord, SourceRecord, TextRecord
from solfer.config.reference.schema import given
from solfer.config.yaml.nodes import shown

Sections = Sequence[tuple[str, type[Record]]]


def _kinds() -> Iterator[tuple[str, type[Record]]]:
    """Yield a section for each kind of pipe that has tags of its own."""
    spaces: dict[KindRecords, list[str]] = {}
    for space, kind in KINDS.items():
        spaces.setdefault(kind, []).append(f"`{space}`")
    for kind, (first, *more) in spaces.items():
        if kind.tags is not None:
            words = " or ".join([f"`space: {first[1:]}", *more])
            yield f"{kind.title}: {words} in `feedback.NAME` and `controller.NAME`", kind.tags


def reference(tags: Mapping[str, type[Record]], files: Sections = ()) -> str:
    """Write Markdown: one table for each section, for the own tags of each component, and for other files.

    Args:
        tags: Records of the components' own tags, by name of the plugin.
        files: Titles and records of files beside a main configuration.
    """
    components = ((f"Tags of the component `{name}`", record) for name, record in tags.items())
    sections: Sections = (
        ("Top level", MainRecord),
        ("`robot`", RobotHead),
        ("`robot.NAME`", RobotRecord),
        ("`feedback.NAME`", FeedbackRecord),
        ("`controller.NAME`", ControllerRecord),
        *_kinds(),
        ("`calibration.NAME`", CalibrationRecord),
        (", ".join(f"`{section}.source`" for section in SECTIONS), SourceRecord),
        (", ".join(f"`{section}.mapping.NAME`" for section in SECTIONS), MappingRecord),
        ("`modules.NAME`", ModuleRecord),
        ("`modules.shared`, and every module with `plugins`", SharedRecord),
        *components,
        ("RT layer (`config/xbot.yaml`): `XBotRTPlugins`", RtPluginsRecord),
        ("RT layer: `executor`", ExecutorRecord),
        *files,
    )
    return "\n".join(line for title, record in sections for line in _section(title, record))


def live(tags: Mapping[str, type[Record]]) -> str:
    """Write Markdown: a table of the tags of each component that can be changed while it runs."""
    rows = ((name, ", ".join(f"`{tag}`" for tag in _live(record))) for name, record in tags.items())
    lines = [f"| `{name}` | {found} |" for name, found in rows if found]
    return "\n".join(("| component | live tags |", "|---|---|", *lines, ""))


def _live(record: type[Record], prefix: str = "") -> Iterator[str]:
    for name, field in record.model_fields.items():
        inner, suffix = _record_in(field.annotation)
        tag = f"{prefix}{field.alias or name}"
        if inner:
            yield from _live(inner, f"{tag}{suffix}.")
        elif is_live(field):
            yield tag


def _section(title: str, record: type[Record]) -> Iterator[str]:
    documentation = (record.__doc__ or "").strip().split("\n\n")[0]
    yield from (f"### {title}", "", " ".join(documentation.split()), "")
    yield from ("| tag | value | default | meaning |", "|---|---|---|---|")
    yield from _rows(record, "", given(record))
    yield ""


def _rows(record: type[Record], prefix: str, given: tuple[str, ...] = ()) -> Iterator[str]:
    for name, field in record.model_fields.items():
        if name in given:
            continue
        tag = f"{prefix}{field.alias or name}"
        inner, suffix = _record_in(field.annotation)
        meaning = f"no effect: {field.deprecated}" if field.deprecated else field.description or ""
        if is_live(field) and not inner:
            meaning += "; live"
        value = "keys below" if inner else _value(field.annotation) + _bounds(field.metadata)
        if inner and (others := _values_beside(field.annotation)):
            value = f"{others}, or keys below"
        yield f"| `{tag}` | {value} | {_default(field)} | {meaning} |".replace("``", "` `")
        if inner:
            yield from _rows(inner, f"{tag}{suffix}.")


def _record_in(annotation: Any) -> tuple[type[Record] | None, str]:
    """Return the record that a field contains, and the key of the user's choice above it, if any."""
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return (None, "") if annotation in (FileRecord, TextRecord) else (annotation, "")
    inner = typing.get_args(annotation)
    found = [_record_in(part) for part in inner]
    record, suffix = next((each for each in found if each[0]), (None, ""))
    return record, ".NAME" + suffix if record and typing.get_origin(annotation) is dict else suffix


def _values_beside(annotation: Any) -> str:
    """Write the values that a union has beside a record; empty: none."""
    if typing.get_origin(annotation) not in (typing.Union, types.UnionType):
        return ""
    others = [part for part in typing.get_args(annotation) if part is not type(None) and not _record_in(part)[0]]
    return " or ".join(dict.fromkeys(map(_value, others)))


def _bounds(metadata: Iterable[Any]) -> str:
    """Write the bounds of a number, as in ', 1 to 4000'."""
    bounds = bounds_of(None, metadata)
    text = {name: str(value) if isinstance(value, int) else f"{value:g}" for name, value in bounds}
    low = text.get("ge") or ("gt" in text and f"above {text['gt']}")
    high = text.get("le") or ("lt" in text and f"below {text['lt']}")
    if low and high:
        return f", {low} to {high}"
    return f", {low} or more" if low else f", {high} at most" if high else ""


def _value(annotation: Any) -> str:
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    if annotation is FileRecord:
        return "file: a path, or `path` and `file`"
    if annotation is TextRecord:
        return "parameter's name, or `file` (and `path`)"
    if origin is typing.Annotated:
        return _value(inner[0]) + "".join(_bounds(part.metadata) for part in inner[1:] if isinstance(part, FieldInfo))
    if origin is typing.Literal:
        return " or ".join(f"`{word}`" for word in inner)
    if origin is dict:
        return "map by name" if inner[1] is Any else f"map by name of: {_value(inner[1])}"
    if origin in (tuple, list):
        count = "" if Ellipsis in inner or origin is list else f" of {len(inner)}"
        return f"list{count}: {_value(inner[0])}"
    if inner:  # a union, or an annotated type
        return " or ".join(dict.fromkeys(_value(part) for part in inner if part is not type(None)))
    scalars = {str: "text", float: "number", int: "whole number", bool: "`true` or `false`", Any: "any"}
    return scalars.get(annotation, str(annotation))


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default
    if field.default_factory is not None or value is None or value == ():
        return ""
    return f"`{shown(value)}`" if not isinstance(value, str) else f"`{value}`" if value else ""
