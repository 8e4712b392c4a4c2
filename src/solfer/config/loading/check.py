"""Checks of a whole main configuration: every module, and the parts that no module uses: these may be incomplete."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

from solfer.config.loading.configuration import Configuration, Part
from solfer.config.loading.layers import AS_CONFIGURED, Layers, ModulePlacement
from solfer.config.loading.library import CONTROLLER, FEEDBACK, Library, named_records
from solfer.config.loading.listed_plugins import Naming
from solfer.config.loading.load import NOT_CONFIGURATIONS, Reading, Used, misspelt_key
from solfer.config.loading.shared import SharedConfiguration, read_shared
from solfer.config.records.calibration import CalibrationRecord
from solfer.config.records.middlewares import MIDDLEWARES
from solfer.config.records.modules import MainRecord, RobotRecord, is_shared
from solfer.config.records.record import parse
from solfer.config.records.sources import MappingRecord, SourceRecord
from solfer.config.yaml.nodes import Mark, YamlNode
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
        return self._notices("warning")

    @property
    def information(self) -> tuple[Notice, ...]:
        """What is worth knowing and no fault of the configuration, ordered by file and line."""
        return self._notices("info")

    def _notices(self, severity: str) -> tuple[Notice, ...]:
        return tuple(notice for notice in self.problems.notices if notice.severity == severity)


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
        _check_module(report, layers, name, default=default, used=used, placement=placement)
    if modules is None:
        for tree in layers.variants(report.problems):
            _check_rest(tree, used, report.problems)
    return report


def _check_module(
    report: CheckReport, layers: Layers, name: str, *, default: Naming, used: Used, placement: ModulePlacement
) -> None:
    found = Problems()
    try:
        node = layers.module(name)
    except SolferError as error:
        report.problems.put(layers.main.nearest(("modules", name)).head, error)
        return
    if is_shared(name, node):
        group = read_shared(layers, name, default, found)
        if group is not None:
            report.shared[name] = group
    else:
        reading = Reading(layers, name, found, placement)
        report.parts[name] = part = reading.part()
        used |= reading.used
        if not found:
            report.configurations[name] = part.configuration
    report.problems.absorb(found)


def _check_rest(tree: YamlNode, used: Used, problems: Problems) -> None:
    """Check robot configurations, sets, pipes, maps, calibrations and sources of a merged tree.

    Args:
        tree: The value of the root key.
        used: Pipes that modules use; these are checked with the modules, for the middleware that is chosen.
        problems: Receives the findings.
    """
    parse(tree, MainRecord, problems)
    named_records(tree.get("calibration"), CalibrationRecord, problems)
    chosen = tree.get("middleware")
    name = None if chosen is None else chosen.value
    for middleware, kind in MIDDLEWARES.items():
        is_chosen = name == middleware
        if not is_chosen and (kind.block or name in MIDDLEWARES and MIDDLEWARES[name].section == kind.section):
            continue  # another middleware has the same section
        section = tree.get(kind.section)
        if is_chosen:
            _check_lists(tree, middleware, problems)
        named_records(section and section.get("mapping"), MappingRecord, problems)
        source = section and section.get("source")
        if source is not None:
            parse(source, SourceRecord, problems)
        for direction in (FEEDBACK, CONTROLLER):
            _check_pipes(tree, middleware, direction, used=used if is_chosen else None, problems=problems)


def _check_lists(tree: YamlNode, middleware: str, problems: Problems) -> None:
    """Check robot configurations, and the pipes that they and the sets name."""
    libraries = {kind: Library(tree, middleware, kind, problems=problems) for kind in (FEEDBACK, CONTROLLER)}
    for direction, library in libraries.items():
        for node in tree.entries(f"{direction}s").values():
            library.check_list(library.list_of(node))
    misspelt = misspelt_key(tree)
    for name, node in tree.entries("robot").items():
        if misspelt is not None and misspelt.where == str(node.head):
            problems.put(node.head, misspelt)
            continue
        if name in NOT_CONFIGURATIONS or parse(node, RobotRecord, problems, name="", configuration=name) is None:
            continue
        chosen = node.get("feedback", "layer")
        if chosen is None:
            libraries[FEEDBACK].check_list(node.get("feedback", "list"))
        else:
            libraries[FEEDBACK].find_set(chosen)


def _check_pipes(tree: YamlNode, middleware: str, direction: str, used: Used | None, problems: Problems) -> None:
    """Check each pipe, or without `used`, for a middleware that is not chosen, each pipe that its section names."""
    generic = tree.entries(direction)
    special = tree.entries(MIDDLEWARES[middleware].section, direction)
    for part in (special,) if used is None else (generic, special):
        for name, node in part.items():
            found = Problems(complete=False)
            Library(tree, middleware, direction, problems=found).pipe(name, node.head)
            problems.absorb(found, notices=(direction, name) not in (used or ()))
