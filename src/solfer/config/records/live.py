"""Tags that can be changed while a plugin runs: the metadata of their fields, and records with other values."""

import json
import re
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic.fields import FieldInfo

from solfer.config.records.bounds import Bounds
from solfer.config.records.record import Record, RecordType, parse
from solfer.config.yaml.compose import compose
from solfer.config.yaml.edit import edited
from solfer.config.yaml.nodes import Key, Mark, YamlNode, dotted
from solfer.config.yaml.problems import Problems
from solfer.errors import ConfigError

LIVE: Bounds = {"json_schema_extra": {"live": True}}
"""Marks a field as live; of a record that may be left out, its own live fields, which are there then, too."""

Path = tuple[Key, ...]


@dataclass(frozen=True)
class LiveField:
    """What is known of a live tag.

    Attributes:
        default: Its default; None: it may be left out, or has none.
        kind: Kind of its value.
        unit: Unit of its number; empty: it has none.
        minimum: Smallest number, `above 0` for one that is left out itself; empty: any.
        maximum: Largest number, likewise.
        description: What it means.
    """

    default: Any
    kind: str
    unit: str
    minimum: str
    maximum: str
    description: str

    @classmethod
    def of(cls, field: FieldInfo) -> "LiveField":
        """Read a field of a record."""
        bounds = dict(bounds_of(field.annotation, field.metadata))
        description = field.description or ""
        units = re.findall(r"\[([^\]]+)\]", description)
        minimum, maximum = (
            f"{bounds[near]:g}" if near in bounds else f"{word} {bounds[far]:g}" if far in bounds else ""
            for near, far, word in (("ge", "gt", "above"), ("le", "lt", "below"))
        )
        kinds = " or ".join(dict.fromkeys(_kinds(field.annotation)))
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        return cls(default, kinds, units[0] if units else "", minimum=minimum, maximum=maximum, description=description)


def is_live(field: FieldInfo) -> bool:
    """Return whether a field is marked as live."""
    return isinstance(field.json_schema_extra, dict) and "live" in field.json_schema_extra


def live_fields(record: Record) -> Iterator[tuple[Path, FieldInfo]]:
    """Yield the paths of the live fields of a record and of those below it."""
    for name, field in type(record).model_fields.items():
        key = field.alias or name
        value = record.__dict__[name]
        if value is None and is_live(field):
            if any(typing.get_origin(part) is dict for part in typing.get_args(field.annotation)):
                continue  # a map that is left out has nothing below it
            value = _empty(field.annotation)
        below = list(_records_below(value))
        for path, inner in below:
            yield from (((key, *path, *rest), found) for rest, found in live_fields(inner))
        if is_live(field) and not below:
            yield (key,), field


def value_at(record: Any, path: Path) -> Any:
    """Return the value at a path below a record; None where a part of it is left out."""
    value = record
    for key in path:
        if isinstance(value, Record):
            fields = type(value).model_fields.items()
            value = value.__dict__[next(name for name, field in fields if key == (field.alias or name))]
        elif isinstance(value, dict):
            value = value.get(key)
        elif value is not None:
            value = value[key]
    return value


def revised(record: RecordType, values: Mapping[Path, str]) -> RecordType:
    """Make the record of another one, with other values; those that stay keep their places.

    Args:
        record: The record.
        values: The new values by path, in YAML; an empty one and `null` leave it out.

    Raises:
        SolferError: A value does not fit, or does not go with the others; SolferErrors: several do not.
    """
    node = record._node
    if node is None:
        node = _node_of(json.loads(record.model_dump_json(by_alias=True, exclude_unset=True)), ())
    problems = Problems()
    for path, text in values.items():
        value = compose(text if text.strip() else "null", dotted(path), problems).plain()
        node = _replaced(node, path, _node_of(value, path))
    made = parse(node, type(record), problems)
    problems.raise_if_any()
    assert made is not None
    return made


def saved(text: str, file: str, module: str, values: Mapping[str, tuple[str, str]]) -> tuple[str, int]:
    """Write the values that differ from the configuration into a file that is laid over it.

    Args:
        text: What is in the file; empty: nothing.
        file: The file, for errors.
        module: Name of the configuration.
        values: The present value of each parameter in YAML, and the configured one, by its name.

    Returns:
        The new text, and how many values of it are new.

    Raises:
        ConfigError: The file is not YAML, or a value cannot be written.
    """
    problems = Problems()
    present = compose(text, file, problems) if text.strip() else None
    changed: dict[Path, Any] = {}
    for name, (value, configured) in values.items():
        path = ("mwoibn", "modules", module, *_path(name))
        new = compose(value or "null", name, problems).plain()
        old = None if present is None else present.get(*path)
        if old is None and value == configured or old is not None and old.plain() == new:
            continue
        if new is None:
            what = f"'{name}' is left out, and was {configured or 'a number'}"
            raise ConfigError(
                what, where=file, expected="a value: a file that is laid over another one takes none away"
            )
        changed[path] = new
    problems.raise_if_any()
    return edited(text, file, changed) if changed else text, len(changed)


def _path(name: str) -> Path:
    """Read the path that `dotted` has written."""
    return tuple(key or int(index) for key, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", name))


class _Requested(Mark):
    """The place of a value that no file contains: its path alone."""

    def __str__(self) -> str:
        return dotted(self.path)


def _node_of(value: Any, path: Path) -> YamlNode:
    mark = _Requested("", 1, 1, path=path)
    inner = value
    if isinstance(value, dict):
        inner = {key: _node_of(each, (*path, key)) for key, each in value.items()}
    elif isinstance(value, list):
        inner = tuple(_node_of(each, (*path, index)) for index, each in enumerate(value))
    return YamlNode(inner, mark, mark)


def _replaced(node: YamlNode | None, path: Path, new: YamlNode, above: Path = ()) -> YamlNode:
    """Return a tree with another value at a path."""
    if not path:
        return new
    key = path[0]
    rest = path[1:]
    below = (*above, key)
    if node is not None and isinstance(node.value, tuple):
        items = [
            _replaced(each, rest, new, above=below) if index == key else each for index, each in enumerate(node.value)
        ]
        return YamlNode(tuple(items), node.mark, node.key)
    entries: dict[str, YamlNode] = {} if node is None else node.entries()
    entries[str(key)] = _replaced(entries.get(str(key)), rest, new, above=below)
    mark = _Requested("", 1, 1, path=above) if node is None else node.mark
    return YamlNode(entries, mark, mark if node is None else node.key)


def _records_below(value: Any) -> Iterator[tuple[Path, Record]]:
    if isinstance(value, Record):
        yield (), value
    elif isinstance(value, dict | tuple):
        for key, each in value.items() if isinstance(value, dict) else enumerate(value):
            yield from (((key, *path), record) for path, record in _records_below(each))


def _empty(annotation: Any) -> Record | None:
    """Make the record that a field may hold, with its defaults; None: it holds none."""
    kinds = (annotation, *typing.get_args(annotation))
    found = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Record)), None)
    return None if found is None else found()


def _kinds(annotation: Any) -> Iterator[str]:
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    scalars = {float: "number", int: "whole number", bool: "true or false", str: "text"}
    if origin is typing.Annotated:
        yield from _kinds(inner[0])
    elif origin is typing.Literal:
        yield from map(str, inner)
    elif origin in (typing.Union, types.UnionType):
        for part in inner:
            yield from _kinds(part)
    elif origin is dict:
        yield from _kinds(inner[1])
    elif origin in (tuple, list):
        yield "list"
    elif annotation is types.NoneType:
        yield "none"
    elif annotation in scalars:
        yield scalars[annotation]


def bounds_of(annotation: Any, metadata: typing.Iterable[Any] = ()) -> Iterator[tuple[str, Any]]:
    """Yield the bounds of a number, or of those of a list."""
    if typing.get_origin(annotation) is typing.Annotated:
        metadata = (*metadata, *annotation.__metadata__)
    for part in metadata:
        if isinstance(part, FieldInfo):
            yield from bounds_of(None, part.metadata)
        yield from ((name, getattr(part, name)) for name in ("ge", "gt", "le", "lt") if hasattr(part, name))
    for inner in typing.get_args(annotation):
        yield from bounds_of(inner)
