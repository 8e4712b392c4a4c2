"""Laying one file over another: maps are merged, lists and scalars replaced, and every value keeps its place."""

from collections.abc import Iterable, Sequence
from functools import reduce

from solfer.config.records.middlewares import SECTIONS
from solfer.config.yaml.nodes import Key, YamlNode
from solfer.config.yaml.problems import Problems

Path = tuple[Key, ...]


def overlaid(parts: Iterable[YamlNode | None], problems: Problems) -> YamlNode | None:
    """Lay parts of a configuration over each other in their order, as `merge` does; None if all of them are None.

    This is the one way in which values meet: main file < file of the system < file of the layer < secondary file, and
    in the result the entry of a pipe in its library < that in its middleware's section.

    Args:
        parts: The earlier ones first; None counts as nothing.
        problems: Receives the clashes.
    """
    given = [part for part in parts if part is not None]
    return reduce(lambda base, over: merge(base, over, problems), given) if given else None


def merge(base: YamlNode, over: YamlNode, problems: Problems, path: Path = ()) -> YamlNode:
    """Lay `over` over `base`; both stay as they are.

    A key without a value changes nothing. Where a map meets a scalar or a list the mistake is noted in `problems` and
    `base` stays; the grammar's alternatives (a parameter or a file, a set's name or a list) replace each other.

    Args:
        base: The earlier value.
        over: The later value, which wins.
        problems: Receives the clashes.
        path: Key path of both below the root of a main configuration.
    """
    if over.value is None:
        return base
    if base.value is None:
        return over
    maps = isinstance(base.value, dict), isinstance(over.value, dict)
    if all(maps):
        return _merge_maps(base, over, problems, path=path)
    if any(maps) and not _is_replaced(path):
        problems.add(over.mark, f"{over.kind} cannot replace {base.kind}", f"what {base.mark} has")
        return base
    return over


def _is_replaced(path: Path) -> bool:
    """Return whether the grammar allows a map or something else at a path, so that the later one replaces the other."""
    patterns: tuple[Path, ...] = (
        ("layers", "*"),
        ("robot", "systems", "*"),
        ("feedbacks", "*"),
        ("controllers", "*"),
        *((middleware, "source", "*") for middleware in SECTIONS),
        *((middleware, "mapping", "*", "urdf") for middleware in SECTIONS),
    )
    return any(_matches(path, pattern) for pattern in patterns)


def _merge_maps(base: YamlNode, over: YamlNode, problems: Problems, path: Path) -> YamlNode:
    # keys of which a map contains one; the later one replaces the map with the other one
    exclusive: tuple[tuple[Path, frozenset[str]], ...] = (
        (("robot", "*", "feedback"), frozenset(("layer", "list"))),
        *(((middleware, "source", "*"), frozenset(("parameter", "file"))) for middleware in SECTIONS),
    )
    for pattern, names in exclusive:
        if _matches(path, pattern) and _chosen(base, names) - _chosen(over, names) and _chosen(over, names):
            return over
    entries = base.entries()
    for name, value in over.items():
        entries[name] = merge(entries[name], value, problems, path=(*path, name)) if name in entries else value
    return YamlNode(entries, base.mark, base.key)


def _chosen(node: YamlNode, names: frozenset[str]) -> set[str]:
    return {name for name in names if node.get(name) is not None}


def _matches(path: Path, pattern: Sequence[Key]) -> bool:
    return len(path) == len(pattern) and all(each in ("*", key) for key, each in zip(path, pattern, strict=True))
