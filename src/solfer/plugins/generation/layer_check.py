"""Checks the file of an RT layer, with its plugins as they run in the layer."""

import os
from collections.abc import Iterable, Sequence

from solfer.config import CheckReport, Problems
from solfer.config.loading.rt_layer import RtLayer, read_layer
from solfer.config.yaml.nodes import Mark
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError, UnknownName, singles
from solfer.plugins.generation.check import check_file
from solfer.plugins.generation.registry import Registry
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
    registry, report, faults = registry or Registry(), CheckReport(), list[SolferError]()
    try:
        layer = read_layer(file)
    except SolferError as error:
        _put(report.problems, singles([error]), file)
        return report
    entries = list(layer.entries(registry.configuration, faults))
    names = [name for _, name in entries]
    for name in modules or ():
        if name not in names:
            faults.append(UnknownName("plugin of the layer", name, names, where=layer.record.where("plugins")))
    _put(report.problems, faults, file)
    report.modules = tuple(name for name in names if modules is None or name in modules)
    for plugin, name in entries:
        if name in report.modules:
            found = check_file(
                layer.main,
                [name],
                search_paths=search_paths,
                system=system,
                robot=robot,
                registry=registry,
                plugin=plugin,
                middleware="XBOT",
                layer="RT",
                rate=layer.executor.rate,
            )
            _add(report, found, layer, plugin, name, registry)
    return report


def _add(report: CheckReport, found: CheckReport, layer: RtLayer, plugin: str, name: str, registry: Registry) -> None:
    """Add what was found of one plugin, and whether there is one of its name."""
    report.configurations |= found.configurations
    report.parts |= found.parts
    report.shared |= found.shared
    part = found.parts.get(name)
    if plugin not in registry and (part is None or part.class_name is None):
        listed = [entry.partition("::")[0] for entry in layer.record.plugins]
        mark = layer.record.place("plugins", listed.index(plugin))
        if mark is not None:
            report.problems.unknown(mark, "plugin", plugin, registry.known)
    report.problems.absorb(found.problems)


def _put(problems: Problems, errors: Iterable[SolferError], file: str | os.PathLike) -> None:
    """Note errors at their places, or at the beginning of the file."""
    for error in errors:
        mark = Mark.read(error.where) or Mark(os.fspath(file), 1, 1)
        problems.put(mark, error.at(str(mark)))
