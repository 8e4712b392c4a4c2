"""Checks a whole main configuration: its grammar, the names of its robot, and the generation of each plugin."""

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any

from solfer.config import CheckReport, Configuration, Part, Problems, Record, SharedPlugin, check, load
from solfer.config.loading.configuration import own_tags
from solfer.config.loading.layers import ModulePlacement
from solfer.config.yaml.files import opened
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError, raise_all, repeats
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.plugins.generation.generator import Generator, UnknownComponent
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.runners import note_runners
from solfer.plugins.generation.sources import check_topics, sinks_of
from solfer.plugins.generation.together import SharedGenerator, find_generator
from solfer.plugins.generation.unbuilt import importable_beside
from solfer.robot.contact_pipes import check_contacts
from solfer.robot.file_checks import check_actuators, checked_files
from solfer.robot.names import check_calibrations, check_names
from solfer.robot.plausibility import check_plausibility
from solfer.robot.shipped import RobotFiles

_ASSUMED_RATE = 100.0
"""Rate of a plugin whose own has a mistake [Hz]."""


def check_file(  # noqa: PLR0913 for users: what replaces values of the file, by its name
    file: str | os.PathLike,
    modules: Sequence[str] | None = None,
    *,
    search_paths: Folders = (),
    system: str | None = None,
    robot: RobotFiles | None = None,
    registry: Registry | None = None,
    plugin: str | None = None,
    middleware: str | None = None,
    layer: str | None = None,
    rate: float | None = None,
    shared: YamlNode | None = None,
) -> CheckReport:
    """Report all mistakes and warnings of a main configuration; raises nothing, and needs no master.

    Whatever the start of a plugin refuses is found: each plugin is generated as at its start, with a middleware that
    connects to nothing.

    Args:
        file: The main configuration.
        modules: Names of the modules to check; by default all of them, and also what no module uses.
        search_paths: Folders to search for files that are not where the configuration expects them.
        system: `SM` or `HW` instead of the value in the file.
        robot: The robot that the names refer to; by default the one that the configuration names.
        registry: The plugins that there are; by default the built-in ones.
        plugin: The plugin that runs the modules; by default those that the configurations are for.
        middleware: Name of a middleware instead of the file's `middleware`.
        layer: `RT` or `NRT` instead of the modules' `layer`.
        rate: Rate of the control cycle instead of that of the layer [Hz].
        shared: The shared plugin that lists the modules.
    """
    registry = registry or Registry()
    report = check(
        file,
        modules,
        search_paths=search_paths,
        system=system,
        default=registry.configuration,
        middleware=middleware,
        placement=ModulePlacement(layer, shared),
    )
    if rate is not None:
        _set_rate(report, rate)
    _check_listed(report, registry)
    listed = [each for group in report.shared.values() for each in group.configurations]
    sinks = sinks_of((*(part.configuration for part in report.parts.values()), *listed))
    with importable_beside(os.fspath(file)):
        absent = [
            part
            for part in report.parts.values()
            if not _check_module(part, report, registry, robot=robot, plugin=plugin, sinks=sinks)
        ]
        for group in report.shared.values():
            check_together(group.plugins, report, registry, robot=robot)
    if middleware is None and layer is None:
        note_runners(report, registry.configuration)
    if absent:
        names = ", ".join(part.configuration.name for part in absent)
        what = f"the plugins of {names} are not available here, so that their own tags are not read"
        report.problems.inform(absent[0].configuration.tree.nearest(("modules",)).head, what)
    return report


def load_checked(file: str | os.PathLike, name: str, plugin: str, **options: Any) -> Configuration:
    """Load a module for a plugin as `load` does; where it has mistakes, all that a check finds is reported.

    Args:
        file: The main configuration.
        name: Name of the module.
        plugin: The plugin that runs it.
        **options: What `load` and `check_file` replace: `search_paths`, `system`, `middleware`, `layer`, `shared`.

    Raises:
        SolferError: The configuration is wrong.
        SolferErrors: In several places.
    """
    file = opened(file)
    try:
        return load(file, name, **options)
    except SolferError as error:
        report = check_file(file, [name], plugin=plugin, **options)
        raise_all(report.errors)
        raise error from None


def _set_rate(report: CheckReport, rate: float) -> None:
    """Set the rate of all plugins [Hz]."""
    for name, part in report.parts.items():
        configuration = replace(part.configuration, rate=rate)
        report.parts[name] = replace(part, configuration=configuration)
        if name in report.configurations:
            report.configurations[name] = configuration


def check_together(
    listed: Sequence[SharedPlugin],
    report: CheckReport,
    registry: Registry,
    robot: RobotFiles | None = None,
    start: Collection[str] | None = None,
) -> None:
    """Check what plugins that run in one process have to agree on: sources, topics, both ends of each, and commands.

    Args:
        listed: The plugins, in the order of their cycles.
        report: Receives the mistakes.
        registry: The plugins that there are.
        robot: The robot that the names refer to; by default the ones that the configurations name.
        start: Names of those that start by themselves; None: all.
    """
    found = Problems()
    files = {each.name: checked_files(each.configuration, found, robot) for each in listed}
    known = {name: each for name, each in files.items() if each is not None}
    if listed and len(known) == len(listed):
        generators = [_generator_of(each, registry, report.problems, found=found) for each in listed]
        whole = not report.errors and not found
        outside = {each.name: DryMiddleware(each.configuration, known[each.name], whole) for each in listed}
        generation = SharedGenerator(
            listed,
            generators,
            lambda each: outside[each.module.name],
            known=lambda each: outside[each.module.name].configuration,
        )
        _note(generation.check(whole, start), listed[0].configuration.tree.head, report.problems, found=found)
    report.problems.absorb(found)


def _generator_of(listed: SharedPlugin, registry: Registry, before: Problems, found: Problems) -> type[Generator]:
    """Find the generator of a plugin of a list; only a mistake in its `class` has not been noted yet."""
    try:
        return find_generator(listed, registry)
    except SolferError as error:
        if listed.configuration.module.class_ is not None:
            _note([error], listed.configuration.tree.head, before, found=found)
        return UnknownComponent


def _note(errors: Iterable[SolferError], mark: Mark, before: Problems, found: Problems) -> None:
    """Note errors, at `mark` if they have no place; those that were noted before are left out."""
    for error in errors:
        if not repeats(error, (*before.errors, *found.errors)):
            place = Mark.read(error.where) or mark
            found.put(place, error.at(str(place)))


def _check_listed(report: CheckReport, registry: Registry) -> None:
    """Check the names of the plugins that shared plugins list."""
    for shared in report.shared.values():
        for index, plugin in enumerate(shared.plugins):
            if plugin.configuration.module.class_ is None and plugin.plugin not in registry:
                mark = shared.record.place("plugins", index)
                report.problems.unknown(mark, "plugin", plugin.plugin, registry.known)


def _check_module(
    part: Part,
    report: CheckReport,
    registry: Registry,
    robot: RobotFiles | None,
    plugin: str | None,
    sinks: frozenset[str],
) -> bool:
    """Check one module; return whether its component is there, or is reported."""
    configuration = part.configuration
    found = Problems()
    whole = configuration.name in report.configurations
    generator = _generator(part, report, registry, plugin=plugin, problems=found)
    record = None if generator is None else generator.component.Tags
    tags = None if record is None else _read_tags(configuration, record, report.problems, found=found)
    if generator is not None and record is None and generator.known:
        for _, tag in own_tags(part.module).items():
            found.warn(tag.head, "has no effect: the component has no tags of its own")
    files = checked_files(configuration, found, robot)
    if files is not None:
        names = files.names()
        check_names(configuration, names, found, tags=tags, dofs=part.dofs)
        check_calibrations(configuration.calibrations.values(), names, found)
        used = {pipe.calibration for pipe in (*configuration.feedbacks, *configuration.controllers)}
        calibrations = [record for name, record in configuration.calibrations.items() if name in used]
        check_plausibility(files, (tags, *calibrations), found)
    check_contacts(configuration, found)
    check_topics(configuration, files, sinks, problems=found)
    if files is None:
        check_actuators(configuration, found)
    else:
        whole = whole and not found
        outside = DryMiddleware(part.assumed(_ASSUMED_RATE), files, whole)
        errors = (generator or UnknownComponent)(outside.configuration, outside).check(whole)
        _note(errors, part.place(), report.problems, found=found)
    report.problems.absorb(found)
    return generator is not None


def _read_tags(configuration: Configuration, record: type[Record], before: Problems, found: Problems) -> Record | None:
    """Read the component's own tags; an unknown key that is known to be another one, misspelt, is not noted again."""
    problems = Problems()
    tags = configuration.read_tags(record, problems)
    _note(problems.errors, configuration.tree.head, before, found=found)
    for notice in problems.notices:
        found.warn(*notice)
    return tags


def _generator(
    part: Part, report: CheckReport, registry: Registry, plugin: str | None, problems: Problems
) -> type[Generator] | None:
    """Find the generator of a module; None if its component is not available here, or not known, with a warning."""
    name = part.configuration.name
    class_name = part.class_name
    plugins = (plugin,) if plugin else _plugins(name, report, registry)
    runnable = [each for each in plugins if each in registry.names()]
    if class_name is None and not runnable:
        if plugins:
            return None
        problems.warn(part.place(), f"no plugin is known for '{name}', so its own tags are not read")
        return UnknownComponent
    try:
        return registry.find(runnable[0] if runnable else name, class_name, str(part.place("class")))
    except SolferError as error:
        problems.put(part.place("class"), error)
        return UnknownComponent


def _plugins(name: str, report: CheckReport, registry: Registry) -> tuple[str, ...]:
    """Find the known plugins that run the configuration `name`: by default, or because a shared plugin lists both."""
    listed = [
        entry.plugin
        for shared in report.shared.values()
        for entry in shared.plugins
        if entry.configuration.name == name and entry.plugin in registry
    ]
    return tuple(dict.fromkeys((*listed, *registry.of_configuration(name))))
