"""Errors of pydantic, reworded and with the place in the file."""

import difflib
import re
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from solfer.config.yaml.nodes import Key, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.errors import nearest

_EXPECTED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
    "list_type": "a list",
    "tuple_type": "a list",
    "set_type": "a list",
    "dict_type": "a map of keys",
    "model_type": "a map of keys",
    "model_attributes_type": "a map of keys",
    "dataclass_type": "a map of keys",
    "finite_number": "a finite number",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "multiple_of": "a multiple of {multiple_of:g}",
    "string_too_short": "a text of at least {min_length} letters",
    "string_too_long": "a text of at most {max_length} letters",
    "string_pattern_mismatch": "a text like {pattern}",
    "too_short": "a list of at least {min_length} values",
    "too_long": "a list of at most {max_length} values",
    "literal_error": "{expected}",
    "enum": "{expected}",
}


def note_errors(
    error: ValidationError,
    node: YamlNode,
    record: type[BaseModel],
    problems: Problems,
    also: Iterable[str],
    *,
    beside: YamlNode | None,
) -> None:
    """Note each error of pydantic in the value of `node` in `problems`.

    A key that is missing while a similar one is unknown is misspelt, and is reported once.

    Args:
        error: All errors in the value.
        node: The value.
        record: The record that it should have been.
        problems: Receives the errors.
        also: Keys that are suggested, too.
        beside: Keys that stand beside those of `node` and belong to others, if there are any.
    """
    alternatives: dict[tuple[Key, ...], list[ErrorDetails]] = {}
    for item in error.errors(include_url=False):
        path = _in_file(node, item["loc"], item["type"])
        alternatives.setdefault(path, []).append(item)
    unknown = [path for path, items in alternatives.items() if items[0]["type"] == "extra_forbidden"]
    for path, items in alternatives.items():
        if items[0]["type"] == "missing" and path:
            if _like(path[-1], [str(other[-1]) for other in unknown if other[:-1] == path[:-1]]):
                continue  # reported as an unknown key
            if beside is not None and len(path) == 1 and _misspelt(str(path[0]), beside, problems):
                continue
        if any(len(other) > len(path) and other[: len(path)] == path for other in alternatives):
            continue  # the other error concerns the member of a union that fits better
        if items[0]["type"] == "extra_forbidden":
            _unknown_key(
                node,
                path,
                _model_at(record, items[0]["loc"][:-1]),
                problems=problems,
                also=also if len(path) == 1 else (),
            )
        else:
            _note_at(node, path, items, record=record, problems=problems)


def _like(key: Key, others: list[str]) -> list[str]:
    """Return the one of other keys that is taken for this one, misspelt."""
    return difflib.get_close_matches(str(key), others, n=1, cutoff=0.75)


def _misspelt(key: str, beside: YamlNode, problems: Problems) -> bool:
    """Note that a key is missing where a similar one stands; return whether there is one."""
    others = beside.entries()
    for other in _like(key, list(others)):
        problems.add(others[other].head, f"the key '{key}' is missing: '{other}' may be misspelt", names=(key,))
        return True
    return False


def _unknown_key(
    node: YamlNode, path: tuple[Key, ...], model: type[BaseModel], problems: Problems, also: Iterable[str]
) -> None:
    key = str(path[-1])
    place = node.nearest(path).head
    if key in (replaced := getattr(model, "replaced", {})):
        problems.add(place, f"the key '{key}' is no more: {replaced[key]}")
        return
    keys = [field.alias or name for name, field in model.model_fields.items() if not field.deprecated]
    joined = re.fullmatch(r"(\w+)(?:: *|:? +)(\S.*)", key)
    if joined is not None and joined[1] in keys:
        what = f"the key '{joined[1]}' is not apart from its value, '{joined[2]}'"
        problems.add(place, what, f"a colon and a blank: `{joined[1]}: {joined[2]}`")
        return
    problems.unknown(place, "key", key, [*keys, *also])


def _note_at(
    node: YamlNode, path: tuple[Key, ...], items: list[ErrorDetails], record: type[BaseModel], problems: Problems
) -> None:
    """Note the error at one place; several items are the alternatives of a union."""
    item = items[0]
    place = node.nearest(path)
    if item["loc"][-1:] == ("[key]",):
        problems.unknown(place.head, "key", str(path[-1]), _allowed(item))
    elif item["type"] == "missing" and isinstance(path[-1], str):
        problem = "has no value" if place.value is None and place is not node else "is missing"
        problems.missing(place.head, f"the key '{path[-1]}' {problem}", _description(record, item["loc"]))
    elif item["type"] == "value_error":
        problems.add(place.mark, str(item["ctx"]["error"]))
    else:
        expected = " or ".join(dict.fromkeys(_expected(each) for each in items))
        allowed = [name for each in items for name in _allowed(each)]
        names = nearest(str(place.value), allowed) if isinstance(place.value, str) else ()
        if _lacks_brackets(record, path, items, place.value):
            expected = expected.replace("a list", "a list of numbers")
            names = [f"[{place.value}]"]
        got = f"a list of {len(place.value)}" if isinstance(place.value, tuple) else place.kind
        problems.add(place.mark, f"expected {expected}, got {got}", names=names)


def _lacks_brackets(record: type[BaseModel], path: tuple[Key, ...], items: list[ErrorDetails], value: Any) -> bool:
    """Whether a number stands where a list of numbers, and no number, would have been right."""
    kinds = [each["type"] for each in items]
    if "tuple_type" not in kinds or isinstance(value, bool) or not isinstance(value, int | float):
        return False
    if any(kind.startswith(("float", "greater", "less")) for kind in kinds):
        return False
    location = items[0]["loc"]
    key = path[-1]
    model = _model_at(record, location[: location.index(key)])
    return any(_lists_numbers(model.model_fields[name].annotation) for name in _fields(model, key))


def _lists_numbers(annotation: Any) -> bool:
    inner = typing.get_args(annotation)
    if typing.get_origin(annotation) is tuple:
        return float in (inner[0], *typing.get_args(inner[0]))
    return any(_lists_numbers(part) for part in inner)


def _expected(item: ErrorDetails) -> str:
    if item["type"] in _EXPECTED:
        return _EXPECTED[item["type"]].format(**item.get("ctx", {}))
    if item["type"] == "missing":
        return "a longer list"
    words = item["msg"].removeprefix("Input should be ")
    return words[:1].lower() + words[1:]


def _allowed(item: ErrorDetails) -> list[str]:
    if item["type"] not in ("literal_error", "enum"):
        return []
    return [word for word in item["ctx"]["expected"].split("'") if word.strip(", ") not in ("", "or")]


def _in_file(node: YamlNode, location: tuple[Key, ...], kind: str) -> tuple[Key, ...]:
    """Return pydantic's location without the names of union members, which no file contains."""
    path: list[Key] = []
    for key in location:
        parent = node.nearest(path)
        if parent.nearest((key,)) is not parent:
            path.append(key)
    if kind == "missing" and location and (not path or path[-1] != location[-1]):
        path.append(location[-1])
    return tuple(path)


def _model_at(record: type[BaseModel], location: tuple[Key, ...]) -> type[BaseModel]:
    """Return the record that pydantic meant with a location."""
    models: list[Any] = [record]
    for key in location:
        annotations = [model.model_fields[name].annotation for model in models for name in _fields(model, key)]
        models = [found for annotation in annotations for found in _records_in(annotation)] or models
        named = [model for model in models if model.__name__ == key]
        models = named or models
    return models[0]


def _description(record: type[BaseModel], location: tuple[Key, ...]) -> str:
    model = _model_at(record, location[:-1])
    for name in _fields(model, location[-1]):
        return (model.model_fields[name].description or "").rstrip(".")
    return ""


def _fields(model: type[BaseModel], key: Key) -> list[str]:
    return [name for name, field in model.model_fields.items() if key in (name, field.alias)]


def _records_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in typing.get_args(annotation) for found in _records_in(part)]
