"""YAML text to Nodes.

Works on libyaml's events: fast, and each anchor may be defined again as YAML 1.2 allows.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import yaml

from solfer.config.yaml import scalars
from solfer.config.yaml.nodes import Key, Mark, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.syntax import not_yaml, odd_blank
from solfer.errors import ConfigError, nearest

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The fastest loader that there is."""


def without_breaks(text: str) -> tuple[str, dict[int, str]]:
    """Replace characters that only YAML 1.1 takes for the end of a line by others that the text does not have.

    Returns:
        The text, of which each character has its place, and the table that makes the characters again.
    """
    found = [each for each in "\x85\u2028\u2029" if each in text]
    free = (each for each in range(0xE000, 0xF8FF) if chr(each) not in text)
    shown = dict(zip(free, found, strict=False))
    return text.translate({ord(each): code for code, each in shown.items()}), shown


def _events(text: str) -> Iterator[Any]:
    text, shown = without_breaks(text)
    for event in yaml.parse(text, LOADER):
        if shown and isinstance(event, yaml.ScalarEvent):
            event.value = event.value.translate(shown)
        yield event


def compose(text: str, file: str, problems: Problems, later: tuple[Key, ...] | None = None) -> YamlNode:
    """Compose the Node of a text with one YAML document.

    Duplicate keys and tags that do not fit are noted in `problems`; the first value of a key counts. In the map at
    the key path `later` the last one counts, which is only a warning.

    Raises:
        ConfigError: The text is not YAML, or contains no document or more than one.
    """
    node, found = _composed(text, file, later)
    problems.absorb(found)
    return node


@lru_cache(maxsize=16)
def _composed(text: str, file: str, later: tuple[Key, ...] | None) -> tuple[YamlNode, Problems]:
    """Compose a text, with its mistakes; a check reads the same files for each module."""
    problems = Problems()
    try:
        return _Composer(text, file, problems, later=later).document(), problems
    except yaml.MarkedYAMLError as error:
        raise not_yaml(error, text, file) from error
    except yaml.YAMLError as error:
        raise ConfigError(
            "not YAML: it contains characters that YAML forbids",
            where=f"{file}:1:1",
            expected="printable text in UTF-8",
        ) from error


class _Composer:
    def __init__(self, text: str, file: str, problems: Problems, later: tuple[Key, ...] | None):
        self._text = text
        self._file = file
        self._problems = problems
        self._later = None if later is None else list(later)
        self._events: Iterator[Any] = _events(text)
        self._anchors: dict[str, tuple[YamlNode, int]] = {}
        self._path: list[Key] = []
        self._size = 0

    def document(self) -> YamlNode:
        next(self._events)  # start of the stream
        if isinstance(next(self._events), yaml.StreamEndEvent):
            raise ConfigError("the file is empty", where=f"{self._file}:1:1", expected="a map of keys")
        node = self._node(next(self._events))
        next(self._events)  # end of the document
        following = next(self._events)
        if not isinstance(following, yaml.StreamEndEvent):
            mark = self._mark(following)
            raise ConfigError("a second YAML document begins here", where=str(mark), expected="one document in a file")
        return node

    def _node(self, event: Any, key: Mark | None = None) -> YamlNode:
        mark = self._mark(event)
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event.anchor, mark, key)
        self._grow(1, mark)
        before = self._size
        if isinstance(event, yaml.ScalarEvent):
            node = YamlNode(self._scalar(event, mark), mark, key)
        elif len(self._path) >= 64:
            raise ConfigError(
                "more than 64 levels",
                where=str(mark._replace(path=())),
                expected="those of the grammar: eight",
            )
        else:
            kind, read = (
                ("seq", self._sequence) if isinstance(event, yaml.SequenceStartEvent) else ("map", self._mapping)
            )
            self._check_tag(event, mark, "!", f"{scalars.CORE}{kind}")
            node = YamlNode(read(), mark, key)
        if event.anchor:
            self._anchors[event.anchor] = node, self._size - before
        return node

    def _alias(self, anchor: str, mark: Mark, key: Mark | None) -> YamlNode:
        if anchor not in self._anchors:
            known = ", ".join(f"&{name}" for name in self._anchors) or "an anchor"
            raise ConfigError(
                f"no anchor '&{anchor}' is complete before this place",
                where=str(mark),
                expected=f"{known} above it",
                names=nearest(anchor, self._anchors),
            )
        node, size = self._anchors[anchor]
        self._grow(size + 1, mark)
        return YamlNode(node.value, mark, key)

    def _check_tag(self, event: Any, mark: Mark, *known: str) -> None:
        """Note a tag that is none of `known`."""
        if event.tag not in (None, *known):
            self._problems.add(mark, f"unknown tag '{event.tag}'", "a value without it")

    def _scalar(self, event: Any, mark: Mark) -> Any:
        if event.tag is not None:
            try:
                return scalars.tagged(event.value, event.tag)
            except ValueError as error:
                self._problems.add(mark, str(error))
                return None
        if not event.implicit[0]:
            return event.value
        self._check_blanks(event)
        return scalars.resolve(event.value)

    def _check_blanks(self, event: Any) -> None:
        """Raise the error of a plain text in which a character that looks like a blank hides a key or a value."""
        if not event.value.isascii():
            odd = odd_blank(self._text, self._file, event.start_mark.line, last=event.end_mark.line)
            if odd is not None:
                raise odd

    def _sequence(self) -> tuple[YamlNode, ...]:
        items: list[YamlNode] = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            self._path.append(len(items))
            items.append(self._node(event))
            self._path.pop()
        return tuple(items)

    def _mapping(self) -> dict[str, YamlNode]:
        own: dict[str, YamlNode] = {}
        merged: dict[str, YamlNode] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise ConfigError(
                    "a key has to be a plain word", where=str(self._mark(event)), expected="a word and a colon"
                )
            name = event.value
            if event.implicit[0]:
                self._check_blanks(event)
            self._path.append(name)
            key = self._mark(event)
            self._check_tag(event, key, "!", f"{scalars.CORE}str", f"{scalars.CORE}merge")
            value = self._node(next(self._events), key)
            self._path.pop()
            if name == "<<" and event.implicit[0]:
                self._merge_key(merged, value)
            elif name in own and self._path == self._later:
                line = own[name].head.line
                self._problems.warn(key, f"the key '{name}' stands twice: this one counts, not that in line {line}")
                own[name] = value
            elif name in own:
                self._problems.add(key, f"the key '{name}' stands twice", f"only the one in line {own[name].head.line}")
            else:
                own[name] = value
        return {**merged, **own}

    def _merge_key(self, merged: dict[str, YamlNode], value: YamlNode) -> None:
        """Merge `<<: *map` or `<<: [*first, *second]`; earlier maps win over later ones."""
        for node in value.value if isinstance(value.value, tuple) else (value,):
            if not isinstance(node.value, dict):
                self._problems.add(node.mark, f"expected a map behind '<<', got {node.kind}")
                continue
            for name, child in node.items():
                merged.setdefault(name, child)

    def _grow(self, count: int, mark: Mark) -> None:
        self._size += count
        if self._size > 200_000:  # aliases are counted as often as they are used
            raise ConfigError("more than 200000 values, aliases counted", where=str(mark), expected="a smaller file")

    def _mark(self, event: Any) -> Mark:
        start = event.start_mark
        return Mark(self._file, start.line + 1, start.column + 1, path=tuple(self._path))
