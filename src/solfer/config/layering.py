"""The files that one module is loaded from, laid over each other: main < system < layer < secondary file."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace

from solfer.config.files import check_file, read_node
from solfer.config.merge import merge
from solfer.config.nodes import Key, Node
from solfer.config.problems import Problems
from solfer.config.record import parse
from solfer.config.search import Folders, relocated
from solfer.config.sources import FileRecord, TextRecord
from solfer.errors import ConfigError, SolferError, UnknownName

ROOT = ("mwoibn",)
"""Top key of every file of a configuration; what stands beside it is free, for anchors."""

_MAIN_ONLY = (("system",), ("layers",), ("robot", "systems"))
_CHOICES = {"system": ("HW", "SM"), "layer": ("NRT", "RT")}  # other words are reported with their records
_MODULE_MAIN_ONLY = ("layer", "secondary_file")


def module_names(file: str | os.PathLike) -> tuple[str, ...]:
    """Names of the modules (plugin configurations) of a main configuration, in its order.

    Raises:
        ConfigError: The file is missing or not YAML, or has no modules.
    """
    return Layers(file, Problems()).names


class Layers:
    """A main configuration and the files that it names, each read once.

    Args:
        file: The main configuration.
        problems: Takes the mistakes of the main file.
        system: `SM` or `HW` instead of what the main file says.
        folders: Where files are looked for that are not where the main file says.
        middleware: `ROS` or `XBOT` instead of what the main file says.

    Attributes:
        main: What stands below the root key of the main file.
        names: Names of its modules.

    Raises:
        ConfigError: The main file is missing or not YAML, or has no modules.
    """

    def __init__(
        self, file: str | os.PathLike, problems: Problems, system: str | None = None, folders: Folders = (),
        middleware: str | None = None,
    ):
        self.main = read_node(file, problems, ROOT)
        for key, value in (("system", system), ("middleware", middleware)):
            if value is not None:
                written = self.main.get(key) or self.main
                self.main = _with(self.main, (key,), replace(written, value=value))
        self.names = tuple(name for name, _ in _modules(self.main).items())
        self._file, self._folders = os.fspath(file), tuple(folders)
        self._read: dict[str, tuple[Node | None, Problems]] = {}

    def module(self, name: str) -> Node:
        """What the main file says about a module.

        Raises:
            UnknownName: There is no such module.
            ConfigError: It is empty.
        """
        modules = _modules(self.main)
        if name not in self.names:
            raise UnknownName("module", name, self.names, where=str(modules.head))
        node = modules.nearest((name,))
        if node.value is None:
            raise ConfigError(f"the module '{name}' is empty", where=str(node.head), expected="layer, robot, ...")
        return node

    def tree(
        self, module: str, problems: Problems, shared: Node | None = None, layer: str | None = None
    ) -> Node:
        """Everything below the root key, merged for one module.

        What cannot be read or merged is noted in `problems` and left out.

        Args:
            module: Name of the module.
            problems: Takes the mistakes.
            shared: The shared plugin that the module runs in: its layer counts, and its mode if that is `idle`.
            layer: `RT` or `NRT` instead of what the module or the shared plugin says.

        Raises:
            UnknownName: There is no such module.
            ConfigError: It is empty.
        """
        node, own = self.module(module), ("modules", module)
        main, chosen, mode = self.main, shared and shared.get("layer"), shared and shared.get("mode")
        if layer is not None:
            chosen = replace(node.get("layer") or node, value=layer)
        if chosen is not None:
            main = _with(main, (*own, "layer"), chosen)
        files = (
            _chosen("system", main.get("robot", "systems"), main.get("system"), problems),
            _chosen("layer", main.get("layers"), main.get(*own, "layer"), problems),
            main.get(*own, "secondary_file"),
        )
        tree = self._merged(main, files, problems)
        return _with(tree, (*own, "mode"), mode) if mode is not None and mode.value == "idle" else tree

    def variants(self, problems: Problems) -> Iterator[Node]:
        """Everything below the root key, merged without a secondary file, for each system with each layer."""
        systems, layers = self.main.get("robot", "systems"), self.main.get("layers")
        for system in [node for _, node in systems.items()] if systems else [None]:
            for layer in [node for _, node in layers.items()] if layers else [None]:
                yield self._merged(self.main, (system, layer), problems)

    def _merged(self, main: Node, files: Iterable[Node | None], problems: Problems) -> Node:
        tree = main
        for named in files:
            over = None if named is None else self._over(named, problems)
            if over is not None:
                tree = merge(tree, over, problems)
        return relocated(tree, self._folders)

    def _over(self, named: Node, problems: Problems) -> Node | None:
        """The root of the file that a Node names; None if it cannot be read."""
        record = parse(relocated(named, self._folders), FileRecord, problems)
        path = None if record is None else location_of(record, problems)
        if path is None:
            return None
        if os.path.samefile(path, self._file):
            problems.add(named.mark, "the main file cannot be laid over itself", "another file")
            return None
        if path not in self._read:
            found = Problems()
            self._read[path] = self._opened(path, named, found), found
        over, found = self._read[path]
        problems.absorb(found)
        return over

    def _opened(self, path: str, named: Node, problems: Problems) -> Node | None:
        try:
            over = read_node(path, problems, ROOT, str(named.mark))
        except SolferError as error:
            problems.put(named.mark, error)
            return None
        self._refuse_main_only(over, problems)
        return over

    def _refuse_main_only(self, over: Node, problems: Problems) -> None:
        paths: list[tuple[Key, ...]] = [*_MAIN_ONLY]
        modules = over.get("modules")
        for name, module in modules.items() if modules else ():
            paths += [("modules", name, key) for key in _MODULE_MAIN_ONLY]
            if name not in self.names:
                known = UnknownName("module", name, self.names)
                near = f"; did you mean {' or '.join(known.names)}?" if known.names else ""
                problems.warn(module.head, f"the main file has no module '{name}', so nothing reads this{near}")
        for path in paths:
            node = over.get(*path)
            if node is not None:
                problems.add(node.head, f"'{path[-1]}' has no effect in this file", "it in the main file")


def location_of(record: FileRecord | TextRecord, problems: Problems) -> str | None:
    """Path of a file that is there; None when it is not, which is noted in `problems`, or when a parameter is meant."""
    try:
        path = record.location
        if path is not None:
            check_file(path, record.where("file"))
    except SolferError as error:
        problems.put(record.place("file"), error)
        return None
    return None if path is None else str(path)


def _modules(main: Node) -> Node:
    modules = main.get("modules")
    if modules is None or not isinstance(modules.value, dict):
        mark = main.head if modules is None else modules.mark
        raise ConfigError("there are no modules here", where=str(mark), expected="'modules:' with plugins by name")
    return modules


def _chosen(kind: str, folder: Node | None, choice: Node | None, problems: Problems) -> Node | None:
    """The Node that names the file of a system or layer."""
    if folder is None or choice is None or not isinstance(choice.value, str):
        return None  # either nothing to merge, or reported with the skeleton or the module
    named = folder.get(choice.value)
    if named is None and choice.value in _CHOICES[kind]:
        problems.unknown(choice.mark, kind, choice.value, [name for name, _ in folder.items()])
    return named


def _with(node: Node, path: tuple[Key, ...], value: Node) -> Node:
    """`node` with `value` at a key path; what is no map on the way stays as it is."""
    if not path:
        return value
    if not isinstance(node.value, dict):
        return node
    below = node.value.get(path[0], Node({}, value.mark))
    return replace(node, value={**node.value, path[0]: _with(below, path[1:], value)})
