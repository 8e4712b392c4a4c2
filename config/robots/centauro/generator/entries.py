"""Reading parameters.yaml: names with braces, mirrored entries, numbers as text."""

import re
from collections.abc import Callable
from typing import Any


def expand(name: str) -> list[str]:
    """All names that a name with braces stands for: 'hip1_{1,4}' and 'wheel_{1..4}'."""
    braces = re.search(r"\{([^{}]*)\}", name)
    if braces is None:
        return [name]
    span = re.fullmatch(r"(\d+)\.\.(\d+)", braces[1])
    members = range(int(span[1]), int(span[2]) + 1) if span else braces[1].split(",")
    return [f"{name[: braces.start()]}{member}{rest}" for member in members for rest in expand(name[braces.end() :])]


def expand_all(names: list[str]) -> list[str]:
    """All names that a list of names stands for."""
    return [single for name in names for single in expand(name)]


def entries(section: dict[str, Any], mirror: Callable[[dict[str, Any]], Any] | None = None) -> dict[str, Any]:
    """Make a section with one entry for each name; `mirror` reflects an entry at the plane y = 0.

    Raises:
        ValueError: Two entries give the same value of one name, or texts that go in step are not equally many.
    """
    found: dict[str, Any] = {}
    for key, value in section.items():
        names = expand(key)
        for index, name in enumerate(names):
            _join(found, name, _pick(value, index, len(names)))
    if mirror is not None:
        for name, value in found.items():
            if isinstance(value, dict) and "mirror" in value:
                beside = {key: item for key, item in value.items() if key != "mirror"}
                reflected = mirror(found[value["mirror"]])
                found[name] = reflected | beside if isinstance(reflected, dict) else reflected
    return found


def opposite(values: list[float], *places: int) -> list[float]:
    """`values` with the sign changed at `places`."""
    return [-value if place in places else value for place, value in enumerate(values)]


def text(values: float | list[float]) -> str:
    """Numbers as URDF text: the shortest that reads back the same."""
    if isinstance(values, list | tuple):
        return " ".join(text(value) for value in values)
    return repr(float(values) or 0.0).removesuffix(".0")


def _join(found: dict[str, Any], name: str, value: Any) -> None:
    if name not in found:
        found[name] = value
        return
    both = found[name].keys() & value.keys() if isinstance(value, dict) and isinstance(found[name], dict) else {name}
    if both:
        raise ValueError(f"'{name}' is given twice: {', '.join(sorted(both))}")
    found[name] = found[name] | value


def _pick(value: Any, index: int, count: int) -> Any:
    """Return the part of a value that belongs to name number `index` of `count`."""
    if isinstance(value, dict):
        return {key: _pick(item, index, count) for key, item in value.items()}
    if isinstance(value, list):
        return [_pick(item, index, count) for item in value]
    if not isinstance(value, str) or "{" not in value:
        return value
    names = expand(value)
    if len(names) != count:
        raise ValueError(f"'{value}' stands for {len(names)} names beside {count}")
    return names[index]
