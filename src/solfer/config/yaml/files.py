"""Files of a configuration: paths, packages, and reading one file into Nodes."""

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

from solfer.config.yaml.compose import compose
from solfer.config.yaml.nodes import Key, YamlNode, dotted
from solfer.config.yaml.packages import package_folder
from solfer.config.yaml.problems import Problems
from solfer.errors import ConfigError, nearest
from solfer.files import read_bytes


@dataclass(frozen=True, eq=False)
class YamlFile:
    """A YAML file that was read. It stands wherever a path may stand, and is not read again there.

    Attributes:
        path: The file.
        node: What is in it.
        problems: The mistakes that did not keep it from being read.
    """

    path: str
    node: YamlNode
    problems: Problems
    _others: dict[str, "YamlFile"] = field(default_factory=dict, repr=False)

    def __fspath__(self) -> str:
        return self.path

    def other(self, path: str | os.PathLike, where: str = "") -> "YamlFile":
        """Return a file that this one names at the place `where`; it is read once.

        Raises:
            ConfigError: As `opened`.
        """
        file = os.fspath(path)
        if file not in self._others:
            self._others[file] = opened(path, where)
        return self._others[file]


def opened(path: str | os.PathLike, where: str = "", later: tuple[Key, ...] | None = None) -> YamlFile:
    """Read a YAML file, unless it was read before; `where` is the place that named it, `later` as for `compose`.

    Raises:
        ConfigError: The file is missing, cannot be read or is not YAML.
    """
    if isinstance(path, YamlFile):
        return path
    file = os.fspath(path)
    problems = Problems()
    problems.reading(file)
    return YamlFile(file, compose(read_text(file, where), file, problems, later=later), problems)


def read_node(path: str | os.PathLike, problems: Problems, root: tuple[Key, ...] = ()) -> YamlNode:
    """Read the Node at key path `root` of a YAML file.

    Args:
        path: The file, also one that was read before.
        problems: Receives the mistakes that do not keep the file from being read.
        root: Keys that lead to the desired part.

    Raises:
        ConfigError: The file is missing, cannot be read, is not YAML, or has nothing at `root`.
    """
    problems.reading(os.fspath(path))
    file = opened(path)
    problems.absorb(file.problems)
    node = file.node
    for depth, key in enumerate(root):
        found = node.entries()
        if key not in found:
            what = f"there is no '{dotted(root[: depth + 1])}' here"
            has = f"; {', '.join(list(found)[:5])} found instead" if found else ""
            raise ConfigError(what + has, where=str(node.head), expected=f"the key '{key}'")
        node = found[key]
    return node


def located(text: str, folder: str | os.PathLike, where: str = "") -> Path:
    """Resolve the path `text`: `package://name/...` and `$(find name)/...`, else relative to `folder`.

    Raises:
        UnknownName: There is no such package; `where` is the place that named it.
        MissingDependency: It is looked for, and ROS is not here.
    """
    match = re.fullmatch(r"(?:package://([^/]*)|\$\(find ([^)]*)\))/*(.*)", text, re.DOTALL)
    if match is None:
        return Path(os.path.normpath(os.path.join(folder, text)))
    return Path(os.path.normpath(os.path.join(package_folder(match[1] or match[2] or "", where), match[3])))


def is_file(path: Path) -> bool:
    """Return whether a file exists; a text that cannot be a path does not name one."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def check_file(path: Path, where: str = "") -> None:
    """Check that a file exists.

    Raises:
        ConfigError: It does not; the error names the files of that folder with similar names.
    """
    try:
        if path.is_file():
            return
        if path.exists():
            kind = "a folder" if path.is_dir() else "a device, a pipe or a socket"
            raise ConfigError(f"'{path}' is {kind}", where=where, expected="a file")
        what = f"there is no file '{path}'"
        folder = path.parent
        if not folder.is_dir():
            raise ConfigError(f"{what}, nor a folder '{folder}'", where=where, expected="a file")
        names = [entry.name for entry in folder.iterdir() if entry.is_file()]
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"cannot look for the file {str(path)!r}: {error}", where=where, expected="the path of a file"
        ) from error
    raise ConfigError(what, where=where, expected="a file", names=nearest(path.name, names))


def read_text(file: str, where: str = "") -> str:
    """Read a text in UTF-8; `where` is the place that named the file.

    Raises:
        ConfigError: The file is missing, cannot be read, or is no such text.
    """
    check_file(Path(file), where)
    try:
        content = read_bytes(file)
    except OSError as error:
        raise ConfigError(
            f"cannot read '{file}': {error.strerror}", where=where, expected="a file that you may read"
        ) from error
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        column = error.start - content.rfind(b"\n", 0, error.start)
        raise ConfigError("not a text in UTF-8", where=f"{file}:{line}:{column}", expected="a text in UTF-8") from error
