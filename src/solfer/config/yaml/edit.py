"""Changes values in the text of a YAML file; comments, order and all other values stay as they are."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import yaml

from solfer.config.yaml.compose import LOADER, compose, without_breaks
from solfer.config.yaml.nodes import Key, dotted
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.syntax import not_yaml
from solfer.errors import ConfigError

_Edit = tuple[int, int, str]
"""Where a text begins and ends, and what replaces it."""


def edited(text: str, file: str, values: Mapping[tuple[Key, ...], Any]) -> str:
    """Return a YAML text with other values; a key that is not there yet follows those that are.

    Args:
        text: The text of one document; empty: there is none.
        file: Its file, for errors.
        values: New values by the keys that lead to them.

    Raises:
        ConfigError: The text is not YAML, or a value has no place of its own in it.
    """
    if not text.strip():
        tree: dict[Key, Any] = {}
        for path, value in values.items():
            _put(tree, path, value, file=file)
        return text + yaml.safe_dump(tree, sort_keys=False, default_flow_style=False, allow_unicode=True)
    problems = Problems()
    expected = compose(text, file, problems).plain()
    for path, value in values.items():
        text = _with(text, file, path, value=value)
        _put(expected, path, value, file=file)
        if compose(text, file, problems).plain() != expected:
            raise _no_place(file, path)
    return text


def _put(tree: Any, path: tuple[Key, ...], value: Any, file: str) -> None:
    """Set a value below a map, and make the maps that lead to it."""
    for depth, key in enumerate(path, start=1):
        if isinstance(key, int) and isinstance(tree, list):
            has_place = key < len(tree)
        else:
            has_place = isinstance(key, str) and isinstance(tree, dict)
        if not has_place:
            raise _no_place(file, path[:depth])
        if depth == len(path):
            tree[key] = deepcopy(value)
        elif isinstance(tree, dict) and tree.get(key) is None:
            tree[key] = {}
        tree = tree[key]


def _no_place(file: str, path: tuple[Key, ...]) -> ConfigError:
    return ConfigError(
        f"'{dotted(path)}' cannot be written here",
        where=file,
        expected="a file that has the whole list, or the value without an anchor",
    )


def _with(text: str, file: str, path: tuple[Key, ...], value: Any) -> str:
    """Return a text with one other value; where that has no place of its own, a text with other values."""
    try:
        node = yaml.compose(without_breaks(text)[0], LOADER)
    except yaml.MarkedYAMLError as error:
        raise not_yaml(error, text, file) from error
    for depth, key in enumerate(path):
        below = _child(node, key)
        if below is None:
            begin, end, new = _entry(text, node, path[depth:], value=value)
            break
        node = below
    else:
        begin = node.start_mark.index
        end = _end(node)
        new = _flow(value)
        if begin == end:  # nothing behind the colon
            new = f" {new}"
        elif text[end - 1] == "\n":  # behind a block of text
            end -= 1
    return text[:begin] + new + text[end:]


def _child(node: yaml.Node, key: Key) -> yaml.Node | None:
    if isinstance(node, yaml.SequenceNode) and isinstance(key, int):
        return node.value[key] if key < len(node.value) else None
    entries = node.value if isinstance(node, yaml.MappingNode) else ()
    return next((value for name, value in entries if name.value == key), None)


def _entry(text: str, node: yaml.Node, path: tuple[Key, ...], value: Any) -> _Edit:
    """Make the edit that adds a value below a node."""
    if isinstance(node, yaml.MappingNode) and not node.flow_style:
        margin = node.value[0][0].start_mark.column
        rows = [f"{' ' * (margin + 2 * depth)}{_flow(key)}:" for depth, key in enumerate(path)]
        last = _end(node)
        place = last if text[last - 1] == "\n" else text.find("\n", last) + 1
        first = ""
        if place == 0:  # the last line of the file has no end
            place = len(text)
            first = "\n"
        return place, place, first + "\n".join(rows) + f" {_flow(value)}\n"
    for key in reversed(path):
        value = {key: value}
    begin = node.start_mark.index
    end = _end(node)
    if isinstance(node, yaml.MappingNode):
        return end - 1, end - 1, f"{', ' if node.value else ''}{_flow(value)[1:-1]}"
    return begin, end, f"{' ' if begin == end else ''}{_flow(value)}"


def _end(node: yaml.Node) -> int:
    """Return where the text of a node ends, without comments and empty lines behind it."""
    while not isinstance(node, yaml.ScalarNode) and not node.flow_style and node.value:
        last = node.value[-1]
        node = last[1] if isinstance(last, tuple) else last
    return int(node.end_mark.index)


def _flow(value: Any) -> str:
    """Write a value in one line."""
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=float("inf"), allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")
