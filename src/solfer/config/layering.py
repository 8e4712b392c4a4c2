"""The files that one module is loaded from, laid over each other: main < system < layer < secondary file."""

import os
from collections.abc import Iterator

from solfer.config.files import check_file, read_node
from solfer.config.merge import merge
from solfer.config.nodes import Node
from solfer.config.problems import Problems
from solfer.config.record import parse
from solfer.config.sources import FileRecord, TextRecord
from solfer.errors import ConfigError, SolferError, UnknownName

ROOT = ("mwoibn",)
"""Top key of every file of a configuration; what stands beside it is free, for anchors."""

_MAIN_ONLY = (("system",), ("layers",), ("robot", "systems"))
_MODULE_MAIN_ONLY = ("layer", "secondary_file")


def module_names(file: str | os.PathLike) -> tuple[str, ...]:
    """Names of the modules (plugin configurations) of a main configuration, in its order.

    Raises:
        ConfigError: The file is missing or not YAML, or has no modules.
    """
    return tuple(name for name, _ in _modules(read_node(file, Problems(), ROOT)).items())


def layered(file: str | os.PathLike, module: str, problems: Problems, system: str | None = None) -> Node:
    """Everything below the root key of a main configuration, merged for one module.

    What cannot be read or merged is noted in `problems` and left out. A `system` replaces that of the main file.

    Raises:
        ConfigError: The main file is missing or not YAML, or has no modules.
        UnknownName: It has no such module.
    """
    main = read_node(file, problems, ROOT)
    if system is not None:
        written = main.get("system") or main
        main = Node({**dict(main.items()), "system": Node(system, written.mark, written.key)}, main.mark, main.key)
    modules = _modules(main)
    if modules.get(module) is None:
        raise UnknownName("module", module, [name for name, _ in modules.items()], where=str(modules.head))
    tree = main
    for named in _files(main, modules.get(module), problems):
        over = _read(named, problems)
        if over is not None:
            tree = merge(tree, over, problems)
    return tree


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


def _files(main: Node, module: Node, problems: Problems) -> Iterator[Node]:
    """Nodes that name the files, in the order of merging."""
    for kind, folder, chosen in (
        ("system", main.get("robot", "systems"), main.get("system")),
        ("layer", main.get("layers"), module.get("layer")),
    ):
        if folder is None or chosen is None or not isinstance(chosen.value, str):
            continue  # either nothing to merge, or reported with the skeleton or the module
        named = folder.get(chosen.value)
        if named is None:
            problems.unknown(chosen.mark, kind, chosen.value, [name for name, _ in folder.items()])
        else:
            yield named
    secondary = module.get("secondary_file")
    if secondary is not None:
        yield secondary


def _read(named: Node, problems: Problems) -> Node | None:
    """The root of the file that a Node names."""
    record = parse(named, FileRecord, problems)
    path = None if record is None else location_of(record, problems)
    if path is None:
        return None
    try:
        over = read_node(path, problems, ROOT, str(named.mark))
    except SolferError as error:
        problems.put(named.mark, error)
        return None
    _refuse_main_only(over, problems)
    return over


def _refuse_main_only(over: Node, problems: Problems) -> None:
    paths = [*_MAIN_ONLY]
    modules = over.get("modules")
    for name, _ in modules.items() if modules else ():
        paths += [("modules", name, key) for key in _MODULE_MAIN_ONLY]
    for path in paths:
        node = over.get(*path)
        if node is not None:
            problems.add(node.head, f"'{path[-1]}' has no effect in this file", "it in the main file")
