"""The record of the tags that a class of a library declares."""

import math
from ctypes import c_double
from typing import Annotated, Any

from pydantic import Field, create_model

from solfer.components.native.records import INTEGER, NUMBER, NUMBERS, SWITCH, TEXT, Tag, Value, text
from solfer.config import Record
from solfer.config.records.live import LIVE
from solfer.errors import ComponentError

RELEASES_GIL = "releases_gil"

_TYPES: dict[int, Any] = {
    NUMBER: float,
    INTEGER: int,
    SWITCH: bool,
    TEXT: str,
    NUMBERS: float,
}
"""Types of values, and of each of several numbers."""


def record_of(name: str, tags: list[Tag]) -> type[Record]:
    """Make the record of a class.

    Raises:
        ComponentError: A tag has no name that can be one, or is declared twice, or its kind is unknown.
    """
    fields: dict[str, Any] = {
        RELEASES_GIL: (
            bool,
            Field(False, description="whether other threads of Python run meanwhile: for cycles above 100 us"),
        )
    }
    for tag in tags:
        key = text(tag.name)
        if not key.isidentifier() or key.startswith("_") or hasattr(Record, key) or key in fields:
            expected = "each once, a name of letters, digits and underscores that begins with a letter"
            raise ComponentError(f"the component '{name}' declares a tag '{key}'", expected=expected)
        if tag.kind not in _TYPES or tag.is_live and tag.kind != NUMBER:
            what = f"the tag '{key}' of the component '{name}' is of the kind {tag.kind}{' and live' * tag.is_live}"
            raise ComponentError(what, expected="a kind of solfer/component.h; numbers alone can be live")
        fields[key] = _type(tag), _field(tag)
    about = f"Tags of the component `{name}`."
    return create_model(f"{name}Tags", __base__=Record, __module__=name, __doc__=about, **fields)


def _type(tag: Tag) -> Any:
    """Return the type of the values of a tag, with the bounds of each number."""
    kind = _TYPES[tag.kind]
    if tag.kind in (SWITCH, TEXT):
        return kind
    bounds = {"ge": tag.lower} if tag.lower > -math.inf else {}
    bounds |= {"le": tag.upper} if tag.upper < math.inf else {}
    bounded = Annotated[kind, Field(**bounds)] if bounds else kind
    return tuple[bounded, ...] if tag.kind == NUMBERS else bounded  # type: ignore[valid-type]


def _field(tag: Tag) -> Any:
    about: dict[str, Any] = {"description": text(tag.description)}
    if tag.is_live:
        about |= LIVE
    if tag.is_required:
        return Field(**about)
    value = tag.value
    default = text(value.text) if tag.kind == TEXT else _TYPES[tag.kind](value.number)
    return Field(default=default, **about)


def fill(value: Value, given: Any) -> None:
    """Write a value of a configuration into the record that the component reads."""
    if isinstance(given, str):
        value.text = given.encode()
    elif isinstance(given, tuple):
        value.numbers = (c_double * len(given))(*given)
        value.size = len(given)
    else:
        value.number = float(given)
