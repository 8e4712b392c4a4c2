"""The files that one module is loaded from, laid over each other: main < system < layer < secondary file < changes."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from solfer.config.loading.file_kinds import other_kind
from solfer.config.records.record import parse
from solfer.config.records.sources import FileRecord, TextRecord
from solfer.config.yaml.files import check_file, opened, read_node
from solfer.config.yaml.merge import overlaid
from solfer.config.yaml.nodes import Key, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders, relocated
from solfer.errors import ConfigError, SolferError, UnknownName

ROOT = ("mwoibn",)
"""Top key of every file of a configuration; other top keys are free, for anchors."""


def module_names(file: str | os.PathLike) -> tuple[str, ...]:
    """Read the names of the modules (plugin configurations) of a main configuration, in its order.

    Raises:
        ConfigError: The file is missing or not YAML, or has no modules.
    """
    return Layers(file, Problems()).names


@dataclass(frozen=True)
class ModulePlacement:
    """Layers in which modules run, where these differ from their configurations.

    Attributes:
        layer: `RT` or `NRT` instead of the layer of the module or the shared plugin.
        shared: The shared plugin that a module runs in: its layer counts, its mode if that is `idle`, and the module's
            own block `shared`.
    """

    layer: str | None = None
    shared: YamlNode | None = None


AS_CONFIGURED = ModulePlacement()
"""Modules run where their configurations say."""


class Layers:
    """A main configuration and the files that it names, each read once.

    Args:
        file: The main configuration, also one that was read before.
        problems: Receives the mistakes of the main file.
        system: `SM` or `HW` instead of the main file's `system`.
        folders: Folders to search for files that are not where the main file expects them.
        middleware: Name of a middleware instead of the main file's `middleware`.
        over: What is laid over all files in the end; None: nothing.

    Attributes:
        file: Path of the main configuration.
        main: The value of the main file's root key.
        names: Names of its modules.

    Raises:
        ConfigError: The main file is missing, not YAML or of another kind, or has no modules.
    """

    def __init__(
        self,
        file: str | os.PathLike,
        problems: Problems,
        system: str | None = None,
        folders: Folders = (),
        middleware: str | None = None,
        *,
        over: YamlNode | None = None,
    ):
        problems.reading(os.fspath(file))
        self._source = opened(file)
        other = other_kind(os.fspath(file), self._source.node)
        if other is not None:
            raise other
        self.main = read_node(self._source, problems, ROOT)
        for key, value in (("system", system), ("middleware", middleware)):
            if value is not None:
                written = self.main.get(key) or self.main
                self.main = _with(self.main, (key,), replace(written, value=value))
        self.names = tuple(_modules(self.main).entries())
        self.file = os.fspath(file)
        self._folders = tuple(folders)
        self._read: dict[str, tuple[YamlNode | None, Problems]] = {}
        self._last = over
        if over is not None:
            self._refuse_main_only(over, problems)

    def module(self, name: str) -> YamlNode:
        """Return the main file's Node of a module.

        Raises:
            UnknownName: There is no such module.
            ConfigError: The module is empty.
        """
        modules = _modules(self.main)
        if name not in self.names:
            raise UnknownName("module", name, self.names, where=str(modules.head))
        node = modules.nearest((name,))
        if node.value is None:
            raise ConfigError(f"the module '{name}' is empty", where=str(node.head), expected="layer, robot, ...")
        return node

    def tree(self, module: str, problems: Problems, placement: ModulePlacement = AS_CONFIGURED) -> YamlNode:
        """Merge everything below the root key for one module.

        Values that cannot be read or merged are noted in `problems` and left out.

        Args:
            module: Name of the module.
            problems: Receives the mistakes.
            placement: Where it runs.

        Raises:
            UnknownName: There is no such module.
            ConfigError: The module is empty.
        """
        node = self.module(module)
        own = ("modules", module)
        main = self.main
        layer = placement.layer
        shared = placement.shared
        chosen = shared and shared.get("layer")
        mode = shared and shared.get("mode")
        within = shared and node.get("shared")
        if within is not None:
            main = _with(main, own, overlaid((node, within), problems) or node)
        if layer is not None:
            chosen = replace(node.get("layer") or node, value=layer)
        if chosen is not None:
            main = _with(main, (*own, "layer"), chosen)
        files = (
            _chosen("system", main.get("robot", "systems"), main.get("system"), problems=problems),
            _chosen("layer", main.get("layers"), main.get(*own, "layer"), problems=problems),
            main.get(*own, "secondary_file"),
        )
        tree = self._merged(main, files, problems)
        return _with(tree, (*own, "mode"), mode) if mode is not None and mode.value == "idle" else tree

    def variants(self, problems: Problems) -> Iterator[YamlNode]:
        """Merge everything below the root key, without a secondary file, for each system with each layer."""
        for system in self.main.entries("robot", "systems").values() or (None,):
            for layer in self.main.entries("layers").values() or (None,):
                yield self._merged(self.main, (system, layer), problems)

    def _merged(self, main: YamlNode, files: Iterable[YamlNode | None], problems: Problems) -> YamlNode:
        overs = (None if named is None else self._over(named, problems) for named in files)
        return relocated(overlaid((main, *overs, self._last), problems) or main, self._folders)

    def _over(self, named: YamlNode, problems: Problems) -> YamlNode | None:
        """Return the root of the file that a Node names; None if it cannot be read."""
        record = parse(relocated(named, self._folders), FileRecord, problems)
        path = None if record is None else location_of(record, problems)
        if path is None:
            return None
        if os.path.samefile(path, self.file):
            problems.add(named.mark, "the main file cannot be laid over itself", "another file")
            return None
        if path not in self._read:
            found = Problems()
            self._read[path] = self._opened(path, named, found), found
        over, found = self._read[path]
        problems.absorb(found)
        return over

    def _opened(self, path: str, named: YamlNode, problems: Problems) -> YamlNode | None:
        try:
            over = read_node(self._source.other(path, str(named.mark)), problems, ROOT)
        except SolferError as error:
            problems.put(named.mark, error)
            return None
        self._refuse_main_only(over, problems)
        return over

    def _refuse_main_only(self, over: YamlNode, problems: Problems) -> None:
        paths: list[tuple[Key, ...]] = [("system",), ("layers",), ("robot", "systems")]
        for name, module in over.entries("modules").items():
            paths += [("modules", name, key) for key in ("layer", "secondary_file")]
            if name not in self.names:
                known = UnknownName("module", name, self.names)
                near = f"; did you mean {' or '.join(known.names)}?" if known.names else ""
                problems.warn(module.head, f"the main file has no module '{name}', so nothing reads this{near}")
        for path in paths:
            node = over.get(*path)
            if node is not None:
                problems.add(node.head, f"'{path[-1]}' has no effect in this file", "it in the main file")


def location_of(record: FileRecord | TextRecord, problems: Problems) -> str | None:
    """Return the path of an existing file; None for a parameter, or after noting a missing file in `problems`."""
    try:
        path = record.location
        if path is not None:
            check_file(path, record.where("file"))
    except SolferError as error:
        problems.put(record.place("file"), error)
        return None
    return None if path is None else str(path)


def _modules(main: YamlNode) -> YamlNode:
    modules = main.get("modules")
    if modules is None or not isinstance(modules.value, dict):
        mark = main.head if modules is None else modules.mark
        raise ConfigError("there are no modules here", where=str(mark), expected="'modules:' with plugins by name")
    return modules


def _chosen(kind: str, folder: YamlNode | None, choice: YamlNode | None, problems: Problems) -> YamlNode | None:
    """Return the Node that names the file of a system or layer."""
    if folder is None or choice is None:
        return None  # either nothing to merge, or reported with the skeleton or the module
    choices = {"system": ("HW", "SM"), "layer": ("NRT", "RT")}
    if choice.value not in choices[kind]:  # reported with its record; without a file there would be other mistakes
        return next(iter(folder.entries().values()), None)
    named = folder.get(choice.value)
    if named is None:
        problems.unknown(choice.mark, kind, choice.value, folder.entries())
    return named


def _with(node: YamlNode, path: tuple[Key, ...], value: YamlNode) -> YamlNode:
    """Return `node` with `value` at a key path; what is not a map along the path stays as it is."""
    if not path:
        return value
    if not isinstance(node.value, dict):
        return node
    entries: dict[Any, YamlNode] = dict(node.value)
    entries[path[0]] = _with(entries.get(path[0], YamlNode({}, value.mark)), path[1:], value)
    return replace(node, value=entries)
