"""Checking a whole main configuration: its grammar, the tags of its components, and the names of its robot."""

import importlib.util
import os
from collections.abc import Sequence

from solfer.config import Configuration, Problems, Record, Report, check
from solfer.config.search import Folders
from solfer.errors import SolferError
from solfer.plugins.registry import Registry
from solfer.robot.names import check_names
from solfer.robot.shipped import RobotFiles, robot_files


def check_file(
    file: str | os.PathLike,
    modules: Sequence[str] | None = None,
    *,
    search_paths: Folders = (),
    system: str | None = None,
    robot: RobotFiles | None = None,
    registry: Registry | None = None,
) -> Report:
    """All mistakes and warnings of a main configuration; nothing is raised, and no master is asked.

    Args:
        file: The main configuration.
        modules: Names of the modules to check; by default all of them, and also what no module uses.
        search_paths: Folders where files are looked for that are not where the configuration says.
        system: `SM` or `HW` instead of what the file says.
        robot: The robot whose names count; by default the one that the configuration names.
        registry: The plugins that there are; by default the built-in ones.
    """
    registry = registry or Registry()
    report = check(file, modules, search_paths=search_paths, system=system, default=registry.configuration)
    _check_listed(report, registry)
    for configuration in report.configurations.values():
        _check_module(configuration, report, registry, robot)
    return report


def _check_listed(report: Report, registry: Registry) -> None:
    """Names of the plugins that shared plugins list."""
    for shared in report.shared.values():
        for index, plugin in enumerate(shared.plugins):
            if plugin.configuration.module.class_ is None and plugin.plugin not in registry:
                mark = shared.record.place("plugins", index)
                report.problems.unknown(mark, "plugin", plugin.plugin, registry.known)


def _check_module(
    configuration: Configuration, report: Report, registry: Registry, robot: RobotFiles | None
) -> None:
    problems, found = report.problems, Problems()
    record = _tags_record(configuration, report, registry, found)
    tags = None if record is None else configuration.read_tags(record, found)
    urdf = configuration.sources.urdf.place()
    try:
        files = robot or robot_files(configuration)
        names = None if files is None else files.names()
    except SolferError as error:
        problems.put(urdf, error.at(str(urdf)))
    else:
        if names is None:
            what = f"the robot '{configuration.robot.name}' has no files here, so its groups, links and joints"
            problems.warn(urdf, f"{what} are not checked; name its URDF and SRDF to check them")
        else:
            check_names(configuration, names, found, tags)
    problems.absorb(found)


def _tags_record(
    configuration: Configuration, report: Report, registry: Registry, problems: Problems
) -> type[Record] | None:
    """The record of a module's own tags; None if its component is not there."""
    module, mark = configuration.module, configuration.module.place()
    plugins = _plugins(module.name, report, registry)
    if module.class_ is None and not any(plugin in registry.names() for plugin in plugins):
        of = f"no plugin is known for '{module.name}'"
        if plugins:
            of = f"the plugin of '{module.name}' is not available here ({', '.join(plugins)})"
        problems.warn(mark, f"{of}, so its own tags are not read")
        return None
    package = (module.class_ or "").partition(":")[0].partition(".")[0]
    if package.isidentifier() and importlib.util.find_spec(package) is None:
        problems.warn(module.place("class"), f"there is no package '{package}' here, so the tags are not read")
        return None
    try:
        name = next((plugin for plugin in plugins if plugin in registry.names()), module.name)
        return registry.find(name, module.class_, module.where("class")).component.Tags or Record
    except SolferError as error:
        problems.put(module.place("class"), error)
        return None


def _plugins(name: str, report: Report, registry: Registry) -> tuple[str, ...]:
    """Known plugins that run the configuration `name`: by default, or because a shared plugin lists both."""
    listed = [entry.plugin for shared in report.shared.values() for entry in shared.plugins
              if entry.configuration.module.name == name and entry.plugin in registry]
    return tuple(dict.fromkeys((*listed, *registry.of_configuration(name))))
