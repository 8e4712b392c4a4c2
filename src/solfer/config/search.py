"""Paths in a configuration for another place: files from another machine, and relative paths made absolute."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from solfer.config.files import located
from solfer.config.nodes import Node
from solfer.errors import SolferError

Folders = Sequence[str | os.PathLike]


def relocated(node: Node, folders: Folders) -> Node:
    """`node` with each file that is not there replaced by the same file below one of `folders`.

    A file is a map with the key `file` and perhaps `path`. `/elsewhere/src/support/RT.yaml` is looked for as
    `elsewhere/src/support/RT.yaml` below each folder, then as `src/support/RT.yaml` and so on: the longest
    tail that is there counts. A file that is found nowhere stays as it is.
    """
    return _files_changed(node, lambda file, folder: _found(file, folder, folders)) if folders else node


def anchored(node: Node) -> Node:
    """`node` with the path of each file made absolute, so that it means the same in any folder."""
    return _files_changed(node, _absolute)


def _files_changed(node: Node, change: Callable[[Node, Node | None], str | None]) -> Node:
    """`node` with other paths for its files; `change` takes what stands at `file` and at `path`."""
    if isinstance(node.value, tuple):
        return replace(node, value=tuple(_files_changed(child, change) for child in node.value))
    if not isinstance(node.value, dict):
        return node
    file, folder = node.value.get("file"), node.value.get("path")
    if file is not None and isinstance(file.value, str) and (folder is None or isinstance(folder.value, str)):
        path = change(file, folder)
        return node if path is None else replace(node, value=_with_file(node.value, replace(file, value=path)))
    return replace(node, value={key: _files_changed(child, change) for key, child in node.items()})


def _with_file(entries: dict[str, Node], file: Node) -> dict[str, Node]:
    return {**{key: child for key, child in entries.items() if key != "path"}, "file": file}


def _absolute(file: Node, folder: Node | None) -> str | None:
    try:
        return str(_written(file, folder).absolute())
    except (SolferError, OSError, ValueError):
        return None  # reported by whoever opens the file


def _found(file: Node, folder: Node | None, folders: Folders) -> str | None:
    """Absolute path of a file below one of `folders`; None if it is where it should be, or nowhere."""
    try:
        path = _written(file, folder)
        if path.is_file():
            return None
        parts = [part for part in path.parts if part != path.anchor]
        for depth in range(len(parts)):
            for base in folders:
                candidate = Path(base, *parts[depth:])
                if candidate.is_file():
                    return str(candidate.absolute())
    except (SolferError, OSError, ValueError):
        return None  # reported by whoever opens the file
    return None


def _written(file: Node, folder: Node | None) -> Path:
    """The path that `file` and `folder` mean together."""
    start: str | Path = os.path.dirname(file.mark.file)
    if folder is not None:
        start = located(folder.value, os.path.dirname(folder.mark.file))
    return located(file.value, start)
