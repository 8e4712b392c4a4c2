"""A configuration as a tree of values that remember where they were written."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

Scalar = bool | int | float | str | None
Key = str | int


class Mark(NamedTuple):
    """A place in a file; lines and columns count from one.

    Attributes:
        path: Keys and list indices that lead from the top of the file to this place.
    """

    file: str
    line: int
    column: int
    path: tuple[Key, ...] = ()

    @classmethod
    def read(cls, text: str) -> "Mark | None":
        """Read what `str` wrote, without the path; None if it is not a place in a file."""
        match = re.match(r"(?P<file>.*?):(?P<line>\d+):(?P<column>\d+)(?=: |$)", text, re.DOTALL)
        return None if match is None else cls(match["file"], int(match["line"]), int(match["column"]))

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}"
        return f"{place}: {dotted(self.path)}" if self.path else place


@dataclass(frozen=True)
class YamlNode:
    """A value and its places.

    Attributes:
        value: Scalar, tuple of Nodes (a list), or dict of Nodes by key (a map).
        mark: Place of the value.
        key: Place of the key that names it; None for items of lists and for the top of a file.
    """

    value: "Scalar | tuple[YamlNode, ...] | dict[str, YamlNode]"
    mark: Mark
    key: Mark | None = None

    @property
    def head(self) -> Mark:
        """Place where a reader looks for this value: its key if it has one."""
        return self.key or self.mark

    @property
    def kind(self) -> str:
        """Kind of the value for messages: 'a map', 'a list', 'nothing', or the value itself."""
        if self.value is None:
            return "nothing"
        if isinstance(self.value, dict):
            return "a map"
        return "a list" if isinstance(self.value, tuple) else shown(self.value)

    def get(self, *path: Key) -> "YamlNode | None":
        """Return the Node below this one, or None if there is none or its value is empty."""
        node: YamlNode | None = self
        for key in path:
            node = _child(node, key)
            if node is None:
                return None
        return None if node.value is None else node

    def nearest(self, path: Iterable[Key]) -> "YamlNode":
        """Return the Node at `path`, or the deepest one above it."""
        node = self
        for key in path:
            child = _child(node, key)
            if child is None:
                return node
            node = child
        return node

    def items(self) -> Iterator[tuple[str, "YamlNode"]]:
        """Return the entries of a map; nothing for all other values."""
        return iter(self.value.items() if isinstance(self.value, dict) else ())

    def entries(self, *path: Key) -> "dict[str, YamlNode]":
        """Return the entries of the map at a key path below this one; none if there is no map."""
        found = self.get(*path)
        return dict(found.items()) if found is not None else {}

    def plain(self) -> Any:
        """Return the value without places: dict, list or scalar."""
        if isinstance(self.value, dict):
            return {key: child.plain() for key, child in self.value.items()}
        if isinstance(self.value, tuple):
            return [child.plain() for child in self.value]
        return self.value


def dotted(path: Iterable[Key]) -> str:
    """Write a key path as text, such as `modules.joint_states.chain` or `feedbacks.online[1]`."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def shown(value: Scalar) -> str:
    """Write a scalar for a message: as in YAML, with long texts cut."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _child(node: YamlNode, key: Key) -> YamlNode | None:
    if isinstance(node.value, dict):
        entries: dict[Any, YamlNode] = node.value
        return entries.get(key)
    if isinstance(node.value, tuple) and isinstance(key, int) and -1 < key < len(node.value):
        return node.value[key]
    return None
