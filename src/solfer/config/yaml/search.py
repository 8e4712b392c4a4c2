"""Paths in a configuration for another place: files from another machine, and relative paths made absolute."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from solfer.config.yaml.files import located
from solfer.config.yaml.nodes import YamlNode
from solfer.errors import SolferError

Folders = Sequence[str | os.PathLike]


def relocated(node: YamlNode, folders: Folders) -> YamlNode:
    """Return `node` with each file that is not there replaced by the same file below one of `folders`.

    A file is a map with the key `file` and perhaps `path`. `/elsewhere/src/support/RT.yaml` is looked for as
    `elsewhere/src/support/RT.yaml` below each folder, then as `src/support/RT.yaml` and so on: the longest
    tail that is there counts. A file that is found nowhere stays as it is.
    """
    return _files_changed(node, lambda file, folder: _found(file, folder, folders)) if folders else node


def anchored(node: YamlNode) -> YamlNode:
    """Return `node` with the path of each file made absolute, so that it means the same in any folder."""
    return _files_changed(node, _absolute)


def _files_changed(node: YamlNode, change: Callable[[YamlNode, YamlNode | None], str | None]) -> YamlNode:
    """Return `node` with other paths for its files; `change` gets the values of `file` and `path`."""
    if isinstance(node.value, tuple):
        return replace(node, value=tuple(_files_changed(child, change) for child in node.value))
    if not isinstance(node.value, dict):
        return node
    file = node.value.get("file")
    folder = node.value.get("path")
    if file is not None and isinstance(file.value, str) and (folder is None or isinstance(folder.value, str)):
        path = change(file, folder)
        return node if path is None else replace(node, value=_with_file(node.value, replace(file, value=path)))
    return replace(node, value={key: _files_changed(child, change) for key, child in node.items()})


def _with_file(entries: dict[str, YamlNode], file: YamlNode) -> dict[str, YamlNode]:
    return {**{key: child for key, child in entries.items() if key != "path"}, "file": file}


def _absolute(file: YamlNode, folder: YamlNode | None) -> str | None:
    try:
        return str(_written(file, folder).absolute())
    except (SolferError, OSError, ValueError):
        return None  # reported where the file is opened


def _found(file: YamlNode, folder: YamlNode | None, folders: Folders) -> str | None:
    """Find a file below one of `folders`, as an absolute path; None if it is where it should be, or nowhere."""
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
        return None  # reported where the file is opened
    return None


def _written(file: YamlNode, folder: YamlNode | None) -> Path:
    """Join `file` and `folder` to a path."""
    start: str | Path = os.path.dirname(file.mark.file)
    if folder is not None:
        start = located(str(folder.value), os.path.dirname(folder.mark.file))
    return located(str(file.value), start)
