"""Checks the file of an RT layer, with its plugins as they run in the layer."""

import os
from collections.abc import Iterable, Iterator, Sequence

from solfer.config import CheckReport, Problems, SharedPlugin
from solfer.config.loading.lists import ListedPlugin, check_group, read_layer
from solfer.config.records.middlewares import RT
from solfer.config.yaml.nodes import Mark
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError, UnknownName, singles
from solfer.plugins.generation.check import check_file, check_together
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.unbuilt import importable_beside
from solfer.robot.shipped import RobotFiles


def check_layer(
    file: str | os.PathLike,
    modules: Sequence[str] | None = None,
    *,
    search_paths: Folders = (),
    system: str | None = None,
    robot: RobotFiles | None = None,
    registry: Registry | None = None,
) -> CheckReport:
    """Report all mistakes and warnings of the file of an RT layer, and of its plugins as they run in the layer.

    Args:
        file: The file of the layer.
        modules: Names of the plugins' configurations to check; by default all that the layer lists.
        search_paths: Folders to search for files that are not where the configuration expects them.
        system: `SM` or `HW` instead of the main configuration's `system`.
        robot: The robot that the names refer to; by default the one that the main configuration names.
        registry: The plugins that there are; by default the built-in ones.
    """
    registry = registry or Registry()
    report = CheckReport()
    try:
        layer = read_layer(file, registry.configuration)
    except SolferError as error:
        _put(report.problems, singles([error]), file)
        return report
    report.problems.absorb(layer.problems)
    names = tuple(entry.name for entry in layer.plugins)
    for name in modules or ():
        if name not in names:
            unknown = UnknownName("plugin of the layer", name, names, where=layer.record.where("plugins"))
            _put(report.problems, [unknown], file)
    report.modules = tuple(name for name in names if modules is None or name in modules)
    usable = list[SharedPlugin]()
    for entry in layer.plugins:
        if entry.name in report.modules:
            found = check_file(
                layer.file,
                [entry.configuration],
                search_paths=search_paths,
                system=system,
                robot=robot,
                registry=registry,
                plugin=entry.plugin,
                middleware=RT.name,
                layer=RT.layer,
                rate=layer.executor.rate,
                shared=entry.shared,
            )
            usable += _add(report, found, entry, registry=registry)
    check_group(usable, names, "the RT layer", problems=report.problems)
    with importable_beside(os.fspath(layer.file)):
        check_together(usable, report, registry, robot=robot, start=layer.start)
    return report


def _add(report: CheckReport, found: CheckReport, entry: ListedPlugin, registry: Registry) -> Iterator[SharedPlugin]:
    """Add what was found of one plugin, and whether there is one of its name; yield it if it can be used."""
    part = found.parts.get(entry.configuration)
    if part is not None:
        report.parts[entry.name] = part
    if entry.plugin not in registry and (part is None or part.class_name is None):
        report.problems.unknown(entry.mark, "plugin", entry.plugin, registry.known)
    report.problems.absorb(found.problems)
    for configuration in found.configurations.values():
        loaded = entry.loaded(configuration)
        report.configurations[entry.name] = loaded.configuration
        yield loaded


def _put(problems: Problems, errors: Iterable[SolferError], file: str | os.PathLike) -> None:
    """Note errors at their places, or at the beginning of the file."""
    for error in errors:
        mark = Mark.read(error.where) or Mark(os.fspath(file), 1, 1)
        problems.put(mark, error.at(str(mark)))
