"""Checks of a whole main configuration: every module, and the parts that no module uses."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

from solfer.config.loading.configuration import Configuration, Part
from solfer.config.loading.layering import AS_CONFIGURED, Layers, ModulePlacement
from solfer.config.loading.reading import Reading, Used
from solfer.config.loading.shared import Naming, SharedConfiguration, read_shared
from solfer.config.loading.unused import check_rest
from solfer.config.records.modules import is_shared
from solfer.config.yaml.nodes import Mark
from solfer.config.yaml.problems import Notice, Problems
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError


@dataclass
class CheckReport:
    """The findings of a check. Later phases, which know the robot or the components, add to its `problems`.

    Attributes:
        modules: Names of the modules that were checked.
        configurations: The modules that can be used, by name.
        parts: What could be read of each module that is not a shared plugin, by name.
        shared: The shared plugins that can be used, by name.
        problems: Mistakes and warnings.
    """

    modules: tuple[str, ...] = ()
    configurations: dict[str, Configuration] = field(default_factory=dict)
    parts: dict[str, Part] = field(default_factory=dict)
    shared: dict[str, SharedConfiguration] = field(default_factory=dict)
    problems: Problems = field(default_factory=Problems)

    @property
    def errors(self) -> tuple[SolferError, ...]:
        """All mistakes, ordered by file and line."""
        return self.problems.errors

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """All warnings, ordered by file and line."""
        return tuple(notice for notice in self.problems.notices if notice.severity == "warning")

    @property
    def information(self) -> tuple[Notice, ...]:
        """What is worth knowing and no fault of the configuration, ordered by file and line."""
        return tuple(notice for notice in self.problems.notices if notice.severity == "info")


def check(
    file: str | os.PathLike,
    modules: Sequence[str] | None = None,
    *,
    search_paths: Folders = (),
    system: str | None = None,
    default: Naming = str,
    middleware: str | None = None,
    placement: ModulePlacement = AS_CONFIGURED,
) -> CheckReport:
    """Check a main configuration with all files that it names; every mistake is reported, none is raised.

    Args:
        file: The main configuration.
        modules: Names of the modules to check; by default all of them, and also unused parts. The unused
            may be incomplete, which is a warning, but not wrong.
        search_paths: Folders to search for files that are not where the configuration expects them.
        system: `SM` or `HW` instead of the file's `system`.
        default: Returns the configuration of a plugin that a shared plugin lists without one.
        middleware: Name of a middleware instead of the file's `middleware`.
        placement: Where the modules run.
    """
    report = CheckReport()
    try:
        layers = Layers(file, report.problems, system, folders=search_paths, middleware=middleware)
    except SolferError as error:
        report.problems.put(Mark(os.fspath(file), 1, 1), error)
        return report
    report.modules = layers.names if modules is None else tuple(dict.fromkeys(modules))
    used: Used = set()
    for name in report.modules:
        _check_module(report, layers, os.fspath(file), name=name, default=default, used=used, placement=placement)
    if modules is None:
        for tree in layers.variants(report.problems):
            check_rest(tree, used, report.problems)
    return report


def _check_module(
    report: CheckReport,
    layers: Layers,
    file: str,
    name: str,
    *,
    default: Naming,
    used: Used,
    placement: ModulePlacement,
) -> None:
    found = Problems()
    try:
        node = layers.module(name)
    except SolferError as error:
        report.problems.put(layers.main.nearest(("modules", name)).head, error)
        return
    if is_shared(name, node):
        group = read_shared(layers, file, name, default=default, problems=found)
        if group is not None:
            report.shared[name] = group
    else:
        reading = Reading(layers.tree(name, found, placement), found)
        report.parts[name] = part = reading.part(file, name)
        used |= reading.used
        if not found:
            report.configurations[name] = part.configuration
    report.problems.absorb(found)
