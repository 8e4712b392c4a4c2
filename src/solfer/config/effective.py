"""The effective configuration of one module: what is left of all files after merging, and where each value is from."""

import json
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

from solfer.config.layering import ROOT
from solfer.config.nodes import Key, Mark, Node, Scalar
from solfer.config.scalars import resolve
from solfer.config.search import anchored

_PLAIN = re.compile(r"[A-Za-z_/$][A-Za-z0-9_/.+$()<>~ -]*(?<! )")
_SWITCHES = frozenset(("yes", "no", "on", "off", "y", "n"))  # of YAML 1.1, which other readers know
_SPECIAL = re.compile(r'["\\]|[^\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]')
_ORIGIN_COLUMN = 48


class Entry(NamedTuple):
    """One value.

    Attributes:
        path: Keys that lead to it, from the top of a file.
        value: A scalar or a list; a map only if it is empty.
        mark: Where it was written.
    """

    path: tuple[Key, ...]
    value: object
    mark: Mark


def pruned(tree: Node, module: str, robot: str, middleware: str) -> Node:
    """The part of a merged tree that one module uses; a main configuration of its own, for any folder.

    Args:
        tree: What stands below the root key.
        module: Name of the module.
        robot: Name of its robot configuration.
        middleware: 'ROS' or 'XBOT'.
    """
    section, kept = middleware.lower(), Node({}, tree.mark, tree.key)
    paths: list[tuple[Key, ...]] = [("middleware",), ("system",)]
    paths += [("robot", key) for key in ("name", "rate", robot)]
    feedback = tree.get("robot", robot, "feedback")
    for direction, chosen in (
        ("feedback", feedback and (feedback.get("list") or feedback.get("layer"))),
        ("controller", tree.get("modules", module, "controller")),
    ):
        paths += _pipes(tree, section, direction, chosen) if chosen else ()
    paths += [("calibration",), (section, "source"), (section, "mapping"), ("modules", module)]
    for path in paths:
        _copy(tree, kept, path)
    modules = kept.value["modules"]
    modules.value[module] = _without(modules.value[module], "secondary_file")
    return anchored(kept)


def entries(tree: Node, path: tuple[Key, ...] = ROOT) -> Iterator[Entry]:
    """All values of a tree, in its order; those without content are left out."""
    if isinstance(tree.value, dict) and tree.value:
        for key, child in tree.items():
            yield from entries(child, (*path, key))
    elif tree.value is not None:
        yield Entry(path, tree.plain(), tree.mark)


def as_yaml(values: Iterable[Entry], origins: bool = True) -> str:
    """Entries as YAML text that can be loaded again.

    Args:
        values: In the order of a tree.
        origins: Whether each line ends with a comment that says where its value is from.
    """
    lines: list[str] = []
    before: tuple[Key, ...] = ()
    for path, value, mark in values:
        common = next((depth for depth, (old, new) in enumerate(zip(before, path, strict=False)) if old != new),
                      min(len(before), len(path) - 1))
        for depth in range(common, len(path) - 1):
            lines.append(f"{'  ' * depth}{_word(path[depth])}:")
        line = f"{'  ' * (len(path) - 1)}{_word(path[-1])}: {_flow(value)}"
        lines.append(f"{line:<{_ORIGIN_COLUMN}}  # {mark.file}:{mark.line}:{mark.column}" if origins else line)
        before = path
    return "\n".join(lines) + "\n"


def _pipes(tree: Node, section: str, direction: str, chosen: Node) -> Iterator[tuple[Key, ...]]:
    """Paths of the set and the pipes that `chosen` names."""
    if isinstance(chosen.value, str):
        yield f"{direction}s", chosen.value
        listed = tree.nearest((f"{direction}s", chosen.value))
        chosen = listed.get("list") or listed
    for name in chosen.plain() if isinstance(chosen.value, tuple) else ():
        pipe = () if name == "all" else (name,)
        yield direction, *pipe
        yield section, direction, *pipe


def _without(node: Node, name: str) -> Node:
    return replace(node, value={key: child for key, child in node.items() if key != name})


def _copy(tree: Node, kept: Node, path: tuple[Key, ...]) -> None:
    """Put the Node at `path` of a tree at the same place of another one; nothing if there is none."""
    found = tree.get(*path)
    if found is None:
        return
    for depth, key in enumerate(path[:-1]):
        way = tree.nearest(path[: depth + 1])
        kept = kept.value.setdefault(key, Node({}, way.mark, way.key))
    kept.value[path[-1]] = found


def _flow(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_word(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(_flow(item) for item in value)}]"
    return _word(value)


def _word(value: Scalar | Key) -> str:
    """A scalar as YAML; a text that would be read as something else is quoted."""
    if isinstance(value, str):
        plain = _PLAIN.fullmatch(value) and value.lower() not in _SWITCHES and isinstance(resolve(value), str)
        return value if plain else f'"{_SPECIAL.sub(_escaped, value)}"'
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    text = "~" if value is None else json.dumps(value)
    return text.replace("e", ".0e") if isinstance(value, float) and "." not in text else text


def _escaped(match: re.Match) -> str:
    character = match[0]
    return f"\\{character}" if character in '"\\' else f"\\u{ord(character):04x}"
