"""Checks a main configuration, or an RT layer: its grammar, names of its robot, and the generation of each plugin."""

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any

from solfer.config import CheckReport, Configuration, Part, Problems, Record, SharedPlugin, check, load
from solfer.config.loading.configuration import own_tags
from solfer.config.loading.layers import ModulePlacement
from solfer.config.loading.rt_layer import read_layer
from solfer.config.loading.shared import check_group
from solfer.config.records.middlewares import RT
from solfer.config.yaml.files import opened
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError, raise_all, repeats, singles
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.plugins.generation.generator import Generator, UnknownComponent
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.runners import note_runners
from solfer.plugins.generation.sources import check_topics, sinks_of
from solfer.plugins.generation.together import SharedGenerator, find_generator
from solfer.plugins.generation.unbuilt import importable_beside
from solfer.plugins.sharing.ends import early_readers
from solfer.robot.contact_pipes import check_contacts
from solfer.robot.description.file_checks import check_actuators, checked_files
from solfer.robot.description.shipped import RobotFiles
from solfer.robot.names import check_calibrations, check_names
from solfer.robot.plausibility import check_plausibility


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
        for name, part in report.parts.items():
            report.parts[name] = replace(part, configuration=part.configuration.at(rate))
        for name, configuration in report.configurations.items():
            report.configurations[name] = configuration.at(rate)
    plugins = _PluginCheck(report, registry, robot)
    plugins.check_listed()
    listed = [each for group in report.shared.values() for each in group.configurations]
    sinks = sinks_of((*(part.configuration for part in report.parts.values()), *listed))
    with importable_beside(os.fspath(file)):
        absent = [part for part in report.parts.values() if not plugins.check(part, plugin, sinks)]
        for group in report.shared.values():
            plugins.check_together(group.plugins)
    if middleware is None and layer is None:
        note_runners(report, registry.configuration)
    if absent:
        names = ", ".join(part.configuration.name for part in absent)
        what = f"the plugins of {names} are not available here, so that their own tags are not read"
        report.problems.inform(absent[0].configuration.tree.nearest(("modules",)).head, what)
    return report


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
        for each in singles([error]):
            mark = Mark.read(each.where) or Mark(os.fspath(file), 1, 1)
            report.problems.put(mark, each.at(str(mark)))
        return report
    report.problems.absorb(layer.problems)
    names = tuple(entry.name for entry in layer.plugins)
    for name in modules or ():
        if name not in names:
            report.problems.unknown(layer.record.place("plugins"), "plugin of the layer", name, names)
    report.modules = tuple(name for name in names if modules is None or name in modules)
    usable = list[SharedPlugin]()
    for entry in layer.plugins:
        if entry.name not in report.modules:
            continue
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
        part = found.parts.get(entry.configuration)
        if part is not None:
            report.parts[entry.name] = part
        if entry.plugin not in registry and (part is None or part.class_name is None):
            report.problems.unknown(entry.mark, "plugin", entry.plugin, registry.known)
        report.problems.absorb(found.problems)
        for configuration in found.configurations.values():
            usable.append(entry.loaded(configuration))
            report.configurations[entry.name] = usable[-1].configuration
    check_group(usable, names, "the RT layer", problems=report.problems)
    with importable_beside(os.fspath(layer.file)):
        _PluginCheck(report, registry, robot).check_together(usable, layer.start)
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


class _PluginCheck:
    """Generates the plugins of a report, and notes in it what was not found before.

    Args:
        report: What could be read of the configurations, and the mistakes so far.
        registry: The plugins that there are.
        robot: The robot that the names refer to; None: the one that each configuration names.
    """

    def __init__(self, report: CheckReport, registry: Registry, robot: RobotFiles | None):
        self._report = report
        self._registry = registry
        self._robot = robot

    def check_listed(self) -> None:
        """Check the names of the plugins that shared plugins list."""
        for shared in self._report.shared.values():
            for index, plugin in enumerate(shared.plugins):
                if plugin.configuration.module.class_ is None and plugin.plugin not in self._registry:
                    mark = shared.record.place("plugins", index)
                    self._report.problems.unknown(mark, "plugin", plugin.plugin, self._registry.known)

    def check(self, part: Part, plugin: str | None, sinks: frozenset[str]) -> bool:
        """Check one module; return whether its component is there, or is reported.

        Args:
            part: The module, as far as it could be read.
            plugin: The plugin that runs it; None: one that its configuration is for.
            sinks: Topics that the plugins of the file publish.
        """
        configuration = part.configuration
        found = Problems()
        generator = self._generator(part, plugin, found)
        tags = None if generator is None else self._tags(part, generator, found)
        files = checked_files(configuration, found, self._robot)
        if files is not None:
            names = files.names()
            check_names(configuration, names, found, tags=tags, dofs=part.dofs)
            check_calibrations(configuration.calibrations.values(), names, found)
            check_plausibility(files, configuration, tags, problems=found)
        check_contacts(configuration, found)
        check_topics(configuration, files, sinks, problems=found)
        if files is None:
            check_actuators(configuration, found)
        else:
            whole = configuration.name in self._report.configurations and not found
            assumed_rate = 100.0  # rate of a plugin whose own has a mistake [Hz]
            outside = DryMiddleware(part.assumed(assumed_rate), files, whole)
            generation = (generator or UnknownComponent)(outside.configuration, outside)
            self._note(generation.check(whole), part.place(), found)
        self._report.problems.absorb(found)
        return generator is not None

    def check_together(self, listed: Sequence[SharedPlugin], start: Collection[str] | None = None) -> None:
        """Check what plugins of one process have to agree on: sources, topics, both ends of each, and commands.

        Args:
            listed: The plugins, in the order of their cycles.
            start: Names of those that start by themselves; None: all.
        """
        found = Problems()
        files = {each.name: checked_files(each.configuration, found, self._robot) for each in listed}
        if listed and all(files.values()):
            generators = [self._listed_generator(each, found) for each in listed]
            whole = not self._report.errors and not found
            outside = {each.name: DryMiddleware(each.configuration, files[each.name], whole) for each in listed}
            generation = SharedGenerator(
                listed,
                generators,
                lambda each: outside[each.module.name],
                known=lambda each: outside[each.module.name].configuration,
            )
            self._note(generation.check(whole, start), listed[0].configuration.tree.head, found)
            for each, record, source in early_readers(listed, next(iter(outside.values())).resolve):
                what = f"'{each.name}' reads '{record.source}' before '{source}' publishes it in the same cycle"
                found.warn(Mark.read(each.where) or listed[0].configuration.tree.head, f"{what}: list it later")
        self._report.problems.absorb(found)

    def _generator(self, part: Part, plugin: str | None, found: Problems) -> type[Generator] | None:
        """Find the generator of a module; None if its component is not available here, or not known, with a warning."""
        name = part.configuration.name
        entries = (entry for shared in self._report.shared.values() for entry in shared.plugins)
        listed = [entry.plugin for entry in entries if entry.configuration.name == name]
        known = [each for each in listed if each in self._registry]
        plugins = (plugin,) if plugin else (*known, *self._registry.of_configuration(name))
        runnable = [each for each in plugins if each in self._registry.names()]
        if part.class_name is None and not runnable:
            if plugins:
                return None
            found.warn(part.place(), f"no plugin is known for '{name}', so its own tags are not read")
            return UnknownComponent
        try:
            return self._registry.find(runnable[0] if runnable else name, part.class_name, str(part.place("class")))
        except SolferError as error:
            found.put(part.place("class"), error)
            return UnknownComponent

    def _listed_generator(self, listed: SharedPlugin, found: Problems) -> type[Generator]:
        """Find the generator of a plugin of a list; only a mistake in its `class` has not been noted yet."""
        try:
            return find_generator(listed, self._registry)
        except SolferError as error:
            if listed.configuration.module.class_ is not None:
                self._note([error], listed.configuration.tree.head, found)
            return UnknownComponent

    def _tags(self, part: Part, generator: type[Generator], found: Problems) -> Record | None:
        """Read the component's own tags; a key that is known to be another one, misspelt, is not noted again."""
        if generator.component.Tags is None:
            for _, tag in own_tags(part.module).items() if generator.known else ():
                found.warn(tag.head, "has no effect: the component has no tags of its own")
            return None
        problems = Problems()
        tags: Record | None = part.configuration.read_tags(generator.component.Tags, problems)
        self._note(problems.errors, part.configuration.tree.head, found)
        for notice in problems.notices:
            found.warn(*notice)
        return tags

    def _note(self, errors: Iterable[SolferError], mark: Mark, found: Problems) -> None:
        """Note errors, at `mark` if they have no place; those that were noted before are left out."""
        for error in errors:
            if not repeats(error, (*self._report.problems.errors, *found.errors)):
                place = Mark.read(error.where) or mark
                found.put(place, error.at(str(place)))
