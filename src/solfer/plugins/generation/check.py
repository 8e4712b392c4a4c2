"""Checks a whole main configuration: its grammar, the tags of its components, and the names of its robot."""

import importlib.util
import os
from collections.abc import Sequence

from solfer.config import CheckReport, Configuration, Part, Problems, Record, check
from solfer.config.loading.configuration import own_tags
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError
from solfer.plugins.generation.registry import Registry
from solfer.robot.contact_pipes import check_contacts
from solfer.robot.names import RobotNames, check_calibrations, check_names
from solfer.robot.shipped import RobotFiles, robot_files

_WITHOUT_ROBOT = "the robot has no files here, so names of its groups, links and joints are not checked"


def check_file(
    file: str | os.PathLike,
    modules: Sequence[str] | None = None,
    *,
    search_paths: Folders = (),
    system: str | None = None,
    robot: RobotFiles | None = None,
    registry: Registry | None = None,
) -> CheckReport:
    """Report all mistakes and warnings of a main configuration; raises nothing, and needs no master.

    Args:
        file: The main configuration.
        modules: Names of the modules to check; by default all of them, and also what no module uses.
        search_paths: Folders to search for files that are not where the configuration expects them.
        system: `SM` or `HW` instead of the value in the file.
        robot: The robot that the names refer to; by default the one that the configuration names.
        registry: The plugins that there are; by default the built-in ones.
    """
    registry = registry or Registry()
    report = check(file, modules, search_paths=search_paths, system=system, default=registry.configuration)
    _check_listed(report, registry)
    for part in report.parts.values():
        _check_module(part, report, registry, robot)
    return report


def _check_listed(report: CheckReport, registry: Registry) -> None:
    """Check the names of the plugins that shared plugins list."""
    for shared in report.shared.values():
        for index, plugin in enumerate(shared.plugins):
            if plugin.configuration.module.class_ is None and plugin.plugin not in registry:
                mark = shared.record.place("plugins", index)
                report.problems.unknown(mark, "plugin", plugin.plugin, registry.known)


def _check_module(part: Part, report: CheckReport, registry: Registry, robot: RobotFiles | None) -> None:
    configuration, found = part.configuration, Problems()
    record = _tags_record(part, report, registry, found)
    tags = None if record is None else configuration.read_tags(record, found)
    names = _names(configuration, found, robot)
    if names is not None:
        check_names(configuration, names, found, tags, part.dofs)
        check_calibrations(configuration.calibrations.values(), names, found)
    check_contacts(configuration, found)
    report.problems.absorb(found)


def _names(configuration: Configuration, problems: Problems, robot: RobotFiles | None) -> RobotNames | None:
    """Look up the names of the robot; None if they are not known."""
    urdf = configuration.tree.nearest((configuration.middleware.lower(), "source", "urdf")).head
    try:
        files = robot or robot_files(configuration)
        if files is not None:
            return files.names()
    except SolferError as error:
        problems.put(urdf, error.at(str(urdf)))
        return None
    problems.warn(urdf, f"{_WITHOUT_ROBOT}; a URDF and an SRDF make it possible")
    return None


def _tags_record(part: Part, report: CheckReport, registry: Registry, problems: Problems) -> type[Record] | None:
    """Find the record of a module's own tags; None if its component is not available."""
    name, class_name = part.configuration.name, part.class_name
    plugins = _plugins(name, report, registry)
    runnable = [plugin for plugin in plugins if plugin in registry.names()]
    if class_name is None and not runnable:
        what = f"no plugin is known for '{name}'"
        if plugins:
            what = f"the plugin of '{name}' is not available here ({', '.join(plugins)})"
        problems.warn(part.place(), f"{what}, so its own tags are not read")
        return None
    package = (class_name or "").partition(":")[0].partition(".")[0]
    if ":" in (class_name or "") and package.isidentifier() and importlib.util.find_spec(package) is None:
        problems.warn(part.place("class"), f"there is no package '{package}' here, so the tags are not read")
        return None
    try:
        where = str(part.place("class"))
        record = registry.find(runnable[0] if runnable else name, class_name, where).component.Tags
    except SolferError as error:
        problems.put(part.place("class"), error)
        return None
    for _, tag in own_tags(part.module).items() if record is None else ():
        problems.warn(tag.head, "has no effect: the component has no tags of its own")
    return record


def _plugins(name: str, report: CheckReport, registry: Registry) -> tuple[str, ...]:
    """Find the known plugins that run the configuration `name`: by default, or because a shared plugin lists both."""
    listed = [
        entry.plugin
        for shared in report.shared.values()
        for entry in shared.plugins
        if entry.configuration.module.name == name and entry.plugin in registry
    ]
    return tuple(dict.fromkeys((*listed, *registry.of_configuration(name))))
