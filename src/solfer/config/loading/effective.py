"""The effective configuration of one module: what is left of all files after merging, with the place of each value."""

import json
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from solfer.config.loading.layers import ROOT
from solfer.config.records.middlewares import MIDDLEWARES
from solfer.config.yaml.nodes import Key, Mark, Scalar, YamlNode
from solfer.config.yaml.scalars import resolve
from solfer.config.yaml.search import anchored


class EffectiveValue(NamedTuple):
    """One value.

    Attributes:
        path: Keys that lead to it, from the top of a file.
        value: A scalar or a list; a map only if it is empty.
        mark: Place of the value.
    """

    path: tuple[Key, ...]
    value: object
    mark: Mark


def pruned(tree: YamlNode, module: str, robot: str, middleware: str) -> YamlNode:
    """Copy the part of a merged tree that one module uses; a main configuration of its own, for any folder.

    Args:
        tree: The value of the root key.
        module: Name of the module.
        robot: Name of its robot configuration.
        middleware: Name of its middleware.
    """
    section = MIDDLEWARES[middleware].section
    kept = YamlNode({}, tree.mark, tree.key)
    paths: list[tuple[Key, ...]] = [("middleware",), ("system",)]
    paths += [("robot", key) for key in ("name", "rate", robot)]
    feedback = tree.get("robot", robot, "feedback")
    for direction, chosen in (
        ("feedback", feedback and (feedback.get("list") or feedback.get("layer"))),
        ("controller", tree.get("modules", module, "controller")),
    ):
        paths += _pipes(tree, section, direction, chosen=chosen) if chosen else ()
    paths += [("calibration",), (section, "source"), (section, "mapping"), ("modules", module)]
    for path in paths:
        _copy(tree, kept, path)
    modules: Any = kept.nearest(("modules",)).value
    node = modules[module]
    modules[module] = replace(node, value={key: child for key, child in node.items() if key != "secondary_file"})
    return anchored(kept)


def entries(tree: YamlNode, path: tuple[Key, ...] = ROOT) -> Iterator[EffectiveValue]:
    """Yield all values of a tree, in its order; those without content are left out."""
    if isinstance(tree.value, dict) and tree.value:
        for key, child in tree.items():
            yield from entries(child, (*path, key))
    elif tree.value is not None:
        yield EffectiveValue(path, tree.plain(), tree.mark)


def as_yaml(values: Iterable[EffectiveValue], origins: bool = True) -> str:
    """Write entries as YAML text that can be loaded again.

    Args:
        values: In the order of a tree.
        origins: Whether each line ends with a comment with the place of its value.
    """
    lines: list[str] = []
    before: tuple[Key, ...] = ()
    for path, value, mark in values:
        common = next(
            (depth for depth, (old, new) in enumerate(zip(before, path, strict=False)) if old != new),
            min(len(before), len(path) - 1),
        )
        for depth in range(common, len(path) - 1):
            lines.append(f"{'  ' * depth}{_word(path[depth])}:")
        line = f"{'  ' * (len(path) - 1)}{_word(path[-1])}: {_flow(value)}"
        lines.append(f"{line:<48}  # {mark.file}:{mark.line}:{mark.column}" if origins else line)
        before = path
    return "\n".join(lines) + "\n"


def _pipes(tree: YamlNode, section: str, direction: str, chosen: YamlNode) -> Iterator[tuple[Key, ...]]:
    """Yield the paths of the set and the pipes that `chosen` names."""
    if isinstance(chosen.value, str):
        yield f"{direction}s", chosen.value
        listed = tree.nearest((f"{direction}s", chosen.value))
        chosen = listed.get("list") or listed
    named = chosen.plain() if isinstance(chosen.value, tuple) else ()
    for name in (each for each in named if isinstance(each, str)):  # what names no pipe was reported when it was read
        pipe = () if name == "all" else (name,)
        yield direction, *pipe
        yield section, direction, *pipe


def _copy(tree: YamlNode, kept: YamlNode, path: tuple[Key, ...]) -> None:
    """Copy the Node at `path` of a tree to the same place of another one, if there is one."""
    found = tree.get(*path)
    if found is None:
        return
    inside: Any = kept.value
    for depth, key in enumerate(path[:-1]):
        place = tree.nearest(path[: depth + 1])
        inside = inside.setdefault(key, YamlNode({}, place.mark, place.key)).value
    inside[path[-1]] = found


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_word(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(_flow(item) for item in value)}]"
    return _word(value)


def _word(value: Scalar | Key) -> str:
    """Write a scalar as YAML; a text that would be read as something else is quoted."""
    if isinstance(value, str):
        is_word = re.fullmatch(r"[A-Za-z_/$][A-Za-z0-9_/.+$()<>~ -]*(?<! )", value)
        switches = ("yes", "no", "on", "off", "y", "n")  # booleans of YAML 1.1, which other readers know
        if is_word and value.lower() not in switches and isinstance(resolve(value), str):
            return value
        special = r'["\\]|[^\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]'
        return f'"{re.sub(special, _escaped, value)}"'
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    text = "~" if value is None else json.dumps(value)
    return text.replace("e", ".0e") if isinstance(value, float) and "." not in text else text


def _escaped(match: re.Match) -> str:
    character = match[0]
    return f"\\{character}" if character in '"\\' else f"\\u{ord(character):04x}"
