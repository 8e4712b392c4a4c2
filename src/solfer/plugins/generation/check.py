"""Checks a whole main configuration: its grammar, the names of its robot, and a dry run of each plugin."""

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any

from solfer.config import CheckReport, Configuration, Part, Problems, Record, SharedPlugin, check, load, read
from solfer.config.loading.configuration import own_tags
from solfer.config.loading.layers import ModulePlacement
from solfer.config.yaml.files import is_file, opened
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError, nearest, raise_all, repeats
from solfer.model.actuators import ActuatorsRecord
from solfer.plugins.generation.dry_run import UnknownComponent, dry_run
from solfer.plugins.generation.generator import Generator
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.runners import note_runners
from solfer.plugins.generation.sources import COMMAND_TOPIC, check_sources, sinks_of
from solfer.plugins.generation.unbuilt import importable_beside
from solfer.plugins.shared.dry_run import dry_run_together
from solfer.plugins.shared.shared_plugin import find_generator
from solfer.robot.contact_pipes import check_contacts
from solfer.robot.names import check_calibrations, check_names
from solfer.robot.plausibility import check_plausibility
from solfer.robot.shipped import RobotFiles, robot_files, robots_beside
from solfer.robot.sources import is_robot_read, require_robot

_WITHOUT_ROBOT = "the robot has no files here, so names of its groups, links and joints are not checked"


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
    files = {each.name: _files(each.configuration, found, robot) for each in listed}
    known = {name: each for name, each in files.items() if each is not None}
    if listed and len(known) == len(listed):
        generators = [_generator_of(each, registry, report.problems, found=found) for each in listed]
        whole = not report.errors and not found
        errors = dry_run_together(listed, generators, lambda each: known[each.module.name], whole=whole, start=start)
        _put(errors, listed[0], report.problems, found=found)
    report.problems.absorb(found)


def _generator_of(listed: SharedPlugin, registry: Registry, before: Problems, found: Problems) -> type[Generator]:
    """Find the generator of a plugin of a list; only a mistake in its `class` has not been noted yet."""
    try:
        return find_generator(listed, registry)
    except SolferError as error:
        if listed.configuration.module.class_ is not None:
            _put([error], listed, before, found=found)
        return UnknownComponent


def _put(errors: Iterable[SolferError], listed: SharedPlugin, before: Problems, found: Problems) -> None:
    """Note errors, in the list if they have no place; those that were noted before are left out."""
    for error in errors:
        if not repeats(error, (*before.errors, *found.errors)):
            found.put(Mark.read(error.where) or listed.configuration.tree.head, error)


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
    files = _files(configuration, found, robot)
    if files is not None:
        names = files.names()
        check_names(configuration, names, found, tags=tags, dofs=part.dofs)
        check_calibrations(configuration.calibrations.values(), names, found)
        used = {pipe.calibration for pipe in (*configuration.feedbacks, *configuration.controllers)}
        calibrations = [record for name, record in configuration.calibrations.items() if name in used]
        check_plausibility(files, (tags, *calibrations), found)
    check_contacts(configuration, found)
    check_sources(configuration, files, sinks, problems=found)
    if files is None:
        _check_actuators(configuration, found)
    else:
        _check_sinks(configuration, files, found)
        errors = dry_run(part, generator or UnknownComponent, files, whole=whole and not found)
        _note(errors, part, report.problems, found=found)
    report.problems.absorb(found)
    return generator is not None


def _read_tags(configuration: Configuration, record: type[Record], before: Problems, found: Problems) -> Record | None:
    """Read the component's own tags; an unknown key that is known to be another one, misspelt, is not noted again."""
    problems = Problems()
    tags = configuration.read_tags(record, problems)
    for error in problems.errors:
        if not repeats(error, before.errors):
            found.put(Mark.read(error.where) or configuration.tree.head, error)
    for notice in problems.notices:
        found.warn(*notice)
    return tags


def _note(errors: Iterable[SolferError], part: Part, before: Problems, found: Problems) -> None:
    """Note the errors of a dry run, at the module if they have no place; those that were noted before are left out."""
    for error in errors:
        if not repeats(error, (*before.errors, *found.errors)):
            mark = Mark.read(error.where) or part.place()
            found.put(mark, error.at(str(mark)))


def _files(configuration: Configuration, problems: Problems, robot: RobotFiles | None) -> RobotFiles | None:
    """Find the files of the robot; None if there are none, or if they are wrong."""
    urdf = configuration.tree.nearest((configuration.section, "source", "urdf")).head
    if _lacks_files(configuration):
        return None
    try:
        files = robot or robot_files(configuration)
        if files is not None:
            files.names()
            return files
    except SolferError as error:
        problems.put(urdf, error.at(str(urdf)))
        return None
    if _check_robot(configuration, problems):
        return None
    name = configuration.tree.get("robot", "name")
    close = nearest(str(name.value), robots_beside(configuration.file)) if name else ()
    if name is not None and close:
        problems.warn(name.mark, f"{_WITHOUT_ROBOT}; did you mean {' or '.join(close)}?")
    else:
        problems.warn(urdf, f"{_WITHOUT_ROBOT}; a URDF and an SRDF make it possible")
    return None


def _lacks_files(configuration: Configuration) -> bool:
    """Whether a file of the model or its groups is not there, which was reported when the configuration was read."""
    sources = configuration.sources
    named = (sources.urdf, sources.srdf) if sources is not None else ()
    paths = [source.location for source in named if source is not None and source.location is not None]
    return not all(is_file(path) for path in paths)


def _check_robot(configuration: Configuration, problems: Problems) -> bool:
    """Check that the files of actuators and contacts know the robot; return whether one does not."""
    sources = configuration.sources
    for source in (sources.actuators, sources.contacts) if sources is not None and is_robot_read(configuration) else ():
        if source is not None and source.location is not None and is_file(source.location):
            try:
                require_robot(configuration, source.location)
            except SolferError as error:
                problems.put(source.place(), error.at(str(source.place())))
                return True
    return False


def _check_sinks(configuration: Configuration, files: RobotFiles, problems: Problems) -> None:
    """Warn of commands to a controller of the robot on a topic that it does not receive."""
    known = {controller.name for controller in files.controllers}
    for record in configuration.controllers:
        if record.lower_level and record.leads_to in known and record.sink not in (None, COMMAND_TOPIC):
            what = f"the controller '{record.leads_to}' receives '{record.leads_to}{COMMAND_TOPIC}', not"
            problems.warn(record.place("sink"), f"{what} '{record.leads_to}{record.sink}'")


def _check_actuators(configuration: Configuration, problems: Problems) -> None:
    """Check that the file of the actuators knows the robot, whose joints are not known."""
    source = configuration.sources.actuators if configuration.sources else None
    robot = configuration.robot
    if source is None or source.file is None or robot is None or not robot.actuators.read:
        return
    if not is_robot_read(configuration):
        return
    try:
        require_robot(configuration, source.location)
        read(source.location, ActuatorsRecord, (robot.name,))
    except SolferError as error:
        mark = source.place()
        problems.put(mark, error.at(str(mark)))


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
