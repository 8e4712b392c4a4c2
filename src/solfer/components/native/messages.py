"""Messages as the numbers at paths of their fields: `twist.linear.x`, `data[7]`, `count:int`."""

import re
from collections.abc import Callable, Sequence
from dataclasses import field, make_dataclass
from typing import Any

from solfer.errors import ComponentError, MiddlewareError

_PATH = re.compile(r"([A-Za-z]\w*(?:\.[A-Za-z]\w*)*)(?:\[(\d+)\])?(?::(int|bool|float))?")
_KINDS: dict[str, Callable[[float], Any]] = {"int": round, "bool": bool, "float": float}


class NumbersOfFields:
    """The fields of a message that a component receives or sends as numbers.

    Args:
        name: Of the message, for errors.
        paths: Paths to its fields.
        more: Further fields of its dataclass, with their types and defaults.

    Attributes:
        message: The dataclass of these fields.
        size: How many numbers there are.

    Raises:
        ComponentError: A path cannot be read, or one goes through another.
    """

    def __init__(self, name: str, paths: Sequence[str], more: Sequence[tuple[str, type, Any]] = ()):
        self._fields: list[tuple[list[str], int | None, Callable[[float], Any]]] = []
        tree: dict[str, Any] = {}
        for path in paths:
            found = _PATH.fullmatch(path)
            if found is None:
                raise ComponentError(f"'{path}' of {name} is no path", expected="one such as twist.linear.x or data[7]")
            keys = found[1].split(".")
            place = tree
            for key in keys[:-1]:
                place = place.setdefault(key, {})
                if not isinstance(place, dict):
                    raise ComponentError(f"'{path}' of {name} goes through a number", expected="fields of the message")
            if keys[-1] in place:
                raise ComponentError(f"'{path}' of {name} is there twice", expected="each field once")
            count = None if found[2] is None else int(found[2])
            place[keys[-1]] = count
            self._fields.append((keys, count, _KINDS[found[3] or "float"]))
        self.size = sum(1 if count is None else count for _, count, _ in self._fields)
        self.message = _dataclass_of(re.sub(r"\W", "_", name), tree, more)
        self._tree = tree
        self._name = name

    def numbers(self, message: Any) -> list[float]:
        """Return the numbers of a received message.

        Raises:
            MiddlewareError: A field is no number, or a list has another length.
        """
        values: list[float] = []
        for keys, count, _ in self._fields:
            value = message
            for key in keys:
                value = getattr(value, key)
            part = [value] if count is None else list(value)
            if len(part) != (1 if count is None else count) or not all(isinstance(each, int | float) for each in part):
                raise MiddlewareError(
                    f"field '{'.'.join(keys)}' of {self._name} is {value!r:.80}",
                    expected="a number" if count is None else f"{count} numbers",
                )
            values += map(float, part)
        return values

    def made(self, numbers: Sequence[float], **more: Any) -> Any:
        """Make the message of numbers."""
        rest = iter(numbers)
        values: dict[str, Any] = {}
        for keys, count, kind in self._fields:
            place = values
            for key in keys[:-1]:
                place = place.setdefault(key, {})
            place[keys[-1]] = kind(next(rest)) if count is None else tuple(kind(next(rest)) for _ in range(count))
        return _filled(self.message, values | more)


def _dataclass_of(name: str, tree: dict[str, Any], more: Sequence[tuple[str, type, Any]] = ()) -> type:
    """Make a dataclass whose fields have what arrives, or dataclasses; they are missed where they have no default."""
    fields: list[Any] = []
    for key, below in tree.items():
        kind = _dataclass_of(f"{name}_{key}", below) if isinstance(below, dict) else Any
        fields.append((key, kind))
    fields += [(key, kind, field(default=default)) for key, kind, default in more]
    return make_dataclass(name, fields, frozen=True)


def _filled(cls: type, values: dict[str, Any]) -> Any:
    kinds = {each.name: each.type for each in cls.__dataclass_fields__.values()}  # type: ignore[attr-defined]
    return cls(
        **{name: _filled(kinds[name], value) if isinstance(value, dict) else value for name, value in values.items()}
    )
