"""Records: parts of a configuration, checked key by key."""

import functools
import json
import logging
import os
import typing
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, PrivateAttr, ValidationError

from solfer.config.records.validation_errors import note_errors
from solfer.config.yaml.files import read_node
from solfer.config.yaml.nodes import Key, Mark, YamlNode
from solfer.config.yaml.problems import Problems

logger = logging.getLogger(__name__)

RecordType = TypeVar("RecordType", bound="Record")


class Record(BaseModel):
    """A map of the configuration with known keys.

    Frozen and strict: an unknown key is an error, a text is never a number, a switch is `true` or `false`, numbers are
    finite. In a file, a key without a value counts as not given. Each field has a description; a field that is marked
    `deprecated` is accepted and reported.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=False, validate_by_name=True
    )

    replaced: ClassVar[Mapping[str, str]] = {}
    """Keys of earlier versions, and what takes their place."""

    renamed: ClassVar[Mapping[str, Mapping[str, tuple[str, Any]]]] = {}
    """Keys of earlier versions with their values as JSON, and the key and the value that take their place."""

    _node: YamlNode | None = PrivateAttr(default=None)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash((type(self), tuple(self.__dict__.values())))

    def place(self, *path: Key) -> Mark | None:
        """Return the place of the record, or of the value at `path` below it; None for a record without a file.

        For a value that is not written down, the nearest place on the way to it counts.
        """
        if self._node is None:
            return None
        node = self._node.nearest(path)
        return node.head if node is self._node else node.mark

    def where(self, *path: Key) -> str:
        """Return `file:line:column` and key path of `place(*path)`; empty for a record that is not from a file."""
        place = self.place(*path)
        return "" if place is None else str(place)

    def placed_as(self: RecordType, other: "Record") -> RecordType:
        """Replace the places by those of `other`, which it was made from, and return the record itself."""
        self._node = other._node
        return self

    def unit_of(self, field: str) -> tuple[str, str]:
        """Return unit of the numbers in a field and what they are compared with, where other fields decide that.

        Both are empty where the field's description and its mark `ComparedWith` say it.
        """
        return "", ""

    def folder(self, *path: Key) -> str:
        """Return the folder of the file with the value at `path`; the working directory without a file."""
        return "" if self._node is None else os.path.dirname(self._node.nearest(path).mark.file)


def read(path: str | os.PathLike, record: type[RecordType], root: Iterable[Key] = ()) -> RecordType:
    """Read a YAML file, or the part of it at key path `root`, into a record.

    Raises:
        ConfigError: The file is missing, cannot be read or is not YAML, or a value does not fit.
        UnknownName: The record does not have a key.
        SolferErrors: Several of these.
    """
    problems = Problems()
    node = read_node(path, problems, tuple(root))
    parsed = parse(node, record, problems)
    problems.log(logger)
    problems.raise_if_any()
    return parsed


def parse(
    node: YamlNode,
    record: type[RecordType],
    problems: Problems,
    also: Iterable[str] = (),
    beside: YamlNode | None = None,
    **given: Any,
) -> RecordType | None:
    """Make the record of a map; mistakes go to `problems`, and then the result may be None.

    Args:
        node: The map.
        record: Type of the result.
        problems: Receives the mistakes.
        also: Keys that may stand beside the record's own ones, for the nearest names of an unknown key.
        beside: Keys of the same map that belong to another record; one of them may be a misspelt key of this one.
        given: Fields that are not in the map, such as the name under which it stands.
    """
    data = node.plain()
    if isinstance(data, dict):
        data = _with_new_names(data, node, record, problems=problems)
        known = set(field_names(record)) - set(given)
        for key in given:
            if key in data:
                problems.unknown(node.get(key).head if node.get(key) else node.head, "key", key, known)
        data = {**data, **given}
    elif data is None:
        data = dict(given)
    try:
        parsed = record.model_validate_json(json.dumps(_without_empty(data, record)))
    except ValidationError as error:
        note_errors(error, node, record, problems=problems, also=also, beside=beside)
        return None
    _attach(parsed, node, problems)
    return parsed


def _with_new_names(data: dict[str, Any], node: YamlNode, record: type[Record], problems: Problems) -> dict[str, Any]:
    """Return a map with the keys and values that have taken the place of those of earlier versions, with warnings."""
    for old, values in record.renamed.items():
        if old not in data or json.dumps(data[old]) not in values:
            continue
        key, value = values[json.dumps(data[old])]
        problems.warn(node.get(old).head, f"the key '{old}' is no more: `{key}: {value}` takes its place")
        data = {key: value} | {name: each for name, each in data.items() if name != old}
    return data


def field_names(record: type[BaseModel]) -> list[str]:
    """Return the keys of a record as a file writes them."""
    return [field.alias or name for name, field in record.model_fields.items()]


def _without_empty(data: Any, annotation: Any) -> Any:
    """Return `data` without the known keys of records that have no value; they count as not given."""
    inner = typing.get_args(annotation)
    if _is_record(annotation):
        if not isinstance(data, dict):
            return data
        names, nested = _fields(annotation)
        kept = {key: value for key, value in data.items() if value is not None or key not in names}
        return {key: _without_empty(value, nested[key]) if key in nested else value for key, value in kept.items()}
    if typing.get_origin(annotation) is dict:
        return {key: _without_empty(value, inner[1]) for key, value in data.items()} if isinstance(data, dict) else data
    if typing.get_origin(annotation) in (tuple, list):
        return [_without_empty(value, inner[0]) for value in data] if isinstance(data, list) else data
    for member in inner:  # a union
        data = _without_empty(data, member)
    return data


def _is_record(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Record)


@functools.cache
def _fields(record: type[BaseModel]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the types of a record's values by their keys, and of those of them that may hold records."""
    fields = {field.alias or name: field.annotation for name, field in record.model_fields.items()}
    return fields, {key: annotation for key, annotation in fields.items() if _holds_records(annotation)}


def _holds_records(annotation: Any) -> bool:
    return _is_record(annotation) or any(map(_holds_records, typing.get_args(annotation)))


def _attach(value: Any, node: YamlNode | None, problems: Problems) -> None:
    """Attach the Nodes that they come from to all records below `value`, and report obsolete keys."""
    if node is None:
        return
    if isinstance(value, Record):
        value._node = node
        _, nested = _fields(type(value))
        for name, field in type(value).model_fields.items():
            key = field.alias or name
            if field.deprecated and node.get(key) is not None:
                problems.warn(node.get(key).head, f"has no effect: {field.deprecated}")
            if key in nested:
                _attach(value.__dict__[name], node.get(key), problems)
    elif isinstance(value, dict):
        for key, item in value.items():
            _attach(item, node.get(key), problems)
    elif isinstance(value, (tuple, list)):
        for index, item in enumerate(value):
            _attach(item, node.get(index), problems)
