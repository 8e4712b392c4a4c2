"""JSON Schema of the configuration, for editors; made from the records that the loader checks with."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from solfer.config.kinds.table import KINDS
from solfer.config.loading.layers import ROOT
from solfer.config.records.calibration import CalibrationRecord
from solfer.config.records.middlewares import SECTIONS
from solfer.config.records.modules import MainRecord, ModuleRecord, RobotHead, RobotRecord, SharedRecord
from solfer.config.records.pipes import CONTROLLER_ALIASES, ControllerRecord, FeedbackRecord, PipeRecord
from solfer.config.records.record import Record
from solfer.config.records.sources import FileRecord, MappingRecord, SourceRecord, TextRecord

Schema = dict[str, Any]


def schema(tags: Mapping[str, type[Record]]) -> Schema:
    """Build the schema of a main configuration, and of files that are laid over one: only the root is required.

    Args:
        tags: Records of the components' own tags, by name of the plugin.
    """
    records = _Records()
    main = records.schema_of(MainRecord)
    module = records.schema_of(ModuleRecord)
    own = _united(records.schema_of(record)["properties"] for record in tags.values())
    module |= {"properties": {**own, **module["properties"]}, "additionalProperties": True}  # tags of other components
    robot = records.schema_of(RobotHead)
    robot["properties"]["systems"] = _map_of(records.schema_of(FileRecord))
    pipes = {
        "feedback": _map_of(records.pipe(FeedbackRecord, *_others("feedback"))),
        "controller": _map_of(records.pipe(ControllerRecord, *_others("controller"))),
    }
    middleware = {
        "source": records.schema_of(SourceRecord),
        "mapping": _map_of(records.schema_of(MappingRecord)),
        **pipes,
    }
    names = {"type": "array", "items": {"type": "string"}}
    pipe_set = {"anyOf": [names, {"type": "object", "properties": {"list": names}, "additionalProperties": False}]}
    sections = {
        "robot": {**robot, "additionalProperties": records.schema_of(RobotRecord)},
        "feedbacks": _map_of(pipe_set),
        "controllers": _map_of(pipe_set),
        **pipes,
        "calibration": _map_of(records.schema_of(CalibrationRecord)),
        **dict.fromkeys(SECTIONS, {"type": "object", "properties": middleware, "additionalProperties": False}),
        "modules": {**_map_of(module), "properties": {"shared": records.schema_of(SharedRecord)}},
    }
    for name, section in sections.items():
        main["properties"][name] = {**section, "description": main["properties"][name]["description"]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Configuration of solfer",
        "type": "object",
        "properties": {ROOT[0]: main},
        "required": list(ROOT),
        "$defs": dict(sorted(records.definitions.items())),
    }


def _united(components: Iterable[Schema]) -> Schema:
    """Unite the tags of components; what several have by one name is any of theirs."""
    own: dict[str, list[Schema]] = {}
    for tag, value in (item for tags in components for item in tags.items()):
        known = own.setdefault(tag, [])
        if value not in known:
            known.append(value)
    return {tag: known[0] if len(known) == 1 else {"anyOf": known} for tag, known in own.items()}


def given(record: type[Record]) -> tuple[str, ...]:
    """Return the fields that the loader fills in from the key above a record, so that no file contains them."""
    if issubclass(record, RobotRecord):
        return ("name", "configuration")
    named = (CalibrationRecord, PipeRecord, MappingRecord, ModuleRecord, SharedRecord)
    return ("name",) if issubclass(record, named) else ()


def _others(direction: str) -> list[type[PipeRecord]]:
    """List the records of the kinds of pipes that have tags of their own."""
    return list(dict.fromkeys(getattr(kind, direction) for kind in KINDS.values() if kind.tags is not None))


class _Records:
    """Schemas of records.

    Attributes:
        definitions: Schemas of the records inside of them, by name.
    """

    def __init__(self) -> None:
        self.definitions: dict[str, Schema] = {}

    def schema_of(self, record: type[Record]) -> Schema:
        """Build the schema of a record, without the fields that the loader fills in."""
        made = record.model_json_schema(ref_template="#/$defs/{model}")
        for name, inner in made.pop("$defs", {}).items():
            self.definitions[name] = _as_read(name, inner)
        for field in given(record):
            made["properties"].pop(field)
        return _as_read(record.__name__, made)

    def pipe(self, record: type[PipeRecord], *others: type[PipeRecord]) -> Schema:
        """Build the schema of a pipe that carries DoFs, or the content of one of the `others`."""
        made = self.schema_of(record)
        own = made["properties"]
        rest = [self.schema_of(other)["properties"] for other in others]
        merged = {key: value for properties in rest for key, value in properties.items()}
        interface = {"anyOf": [own["interface"], *(properties["interface"] for properties in rest)]}
        return {**made, "properties": {**merged, **own, "interface": interface}}


def _as_read(name: str, made: Schema) -> Schema:
    """Add what the loader accepts beyond the record itself: keys from several files, omitted pipes, old names."""
    made.pop("required", None)
    made.pop("title", None)
    properties = made.get("properties", {})
    for value in properties.values():
        value.pop("title", None)
    for words in _words(properties.get("space", {})):
        words.append("SKIP")
    for words in _words(properties.get("type", {})):
        words += ["", *CONTROLLER_ALIASES] if "impedance" in words else ()
    is_text = name in (FileRecord.__name__, TextRecord.__name__)  # a bare text stands for their main key
    return {"anyOf": [{"type": "string"}, made]} if is_text else made


def _words(key: Schema) -> Iterator[list[str]]:
    """Yield the lists of allowed words in the schema of a key."""
    for part in (key, *key.get("anyOf", ())):
        if "enum" in part:
            yield part["enum"]


def _map_of(value: Schema) -> Schema:
    return {"type": "object", "additionalProperties": value}
