"""Plugin configurations of a file, for the commands."""

import argparse
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from solfer.config import CheckReport, Configuration, check
from solfer.errors import ConfigError, SolferError, raise_all
from solfer.interfaces.declaration import Action, Declaration, Parameter, Service, TopicIn, TopicOut, full_name
from solfer.plugins.generation.dry_run import declared
from solfer.plugins.generation.generator import Generator
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.unbuilt import importable_beside
from solfer.robot import robot_files

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Declared:
    """What a component declares besides its pipes.

    Attributes:
        kind: `service`, `topic in`, `topic out`, `action` or `parameter`.
        name: Its whole name.
        interface: `package/Type`, or the type of a parameter.
    """

    kind: str
    name: str
    interface: str


def report_of(options: argparse.Namespace) -> CheckReport:
    """Check FILE, or the configuration -n in it; the correct parts of a whole FILE with mistakes can be used.

    Raises:
        ConfigError: No FILE is given.
        SolferErrors: The configuration -n is wrong.
    """
    if options.file is None:
        raise ConfigError(f"{options.kind} are those of a main configuration", expected="FILE on the command line")
    names = None if options.name is None else (options.name,)
    report = checked(options.file, names, options.system, search_paths=options.search_paths)
    if names or not report.modules:
        raise_all(report.errors)
    if report.errors:
        _LOG.warning("warning: %s has mistakes, so that something may be left out: see `solfer check`", options.file)
    return report


def checked(
    file: str, names: Sequence[str] | None, system: str | None = None, search_paths: Sequence[str] = ()
) -> CheckReport:
    """Check a file as `check` does, with the default configurations of the known plugins."""
    return check(file, names, search_paths=search_paths, system=system, default=Registry().configuration)


def configurations_of(report: CheckReport) -> Iterator[Configuration]:
    """Yield all plugins of a report that can be used, also those that shared plugins list, each once."""
    found: dict[str, Configuration] = {}
    for name in report.modules:
        shared = report.shared.get(name)
        for configuration in shared.configurations if shared else filter(None, [report.configurations.get(name)]):
            found.setdefault(configuration.module.name, configuration)
    return iter(found.values())


def component_of(configuration: Configuration) -> str:
    """Return the name of a configuration's component: its class, or the known plugin that the configuration is for."""
    module = configuration.module
    registry = Registry()
    if module.class_ == "solfer.components:Component":  # its plugin maps what its pipes receive
        return "no algorithm"
    if module.class_ is not None:
        return module.class_.rpartition(":")[2]
    plugins = registry.of_configuration(configuration.name)
    runs = [name for name in plugins if name in registry.names()]
    return registry.find(runs[0]).component.__name__ if runs else next(iter(plugins), module.name)


def generator_of(configuration: Configuration) -> type[Generator]:
    """Return the generator of a configuration's component: its class, or the known plugin that it is for.

    Raises:
        SolferError: There is none.
    """
    module = configuration.module
    registry = Registry()
    available = registry.names()
    runs = sorted(registry.of_configuration(module.name), key=lambda name: name not in available)
    return registry.find(runs[0] if runs else module.name, module.class_, module.where())


def known_generator_of(configuration: Configuration) -> type[Generator] | None:
    """Return the generator of a configuration's component, None where no plugin here has this configuration.

    Raises:
        SolferError: There is no such class.
    """
    registry = Registry()
    class_ = configuration.module.class_
    runs = [name for name in registry.of_configuration(configuration.name) if name in registry.names()]
    return generator_of(configuration) if runs or class_ else None


def declared_by(configuration: Configuration) -> tuple[Declared, ...]:
    """List services, topics, actions and parameters of a plugin; none of one whose component is not here.

    Raises:
        SolferError: The robot is not known, or a part of the plugin cannot be made.
        SolferErrors: Several of these.
    """
    files = robot_files(configuration)
    module = configuration.module
    generator = known_generator_of(configuration)
    if generator is None:
        return ()
    if files is None:
        raise ConfigError("its robot is not known", where=module.where("robot"), expected="`robot.name`, or files")
    return tuple(_printed(module.name, each) for each in declared(configuration, generator, files))


def known_declarations(configuration: Configuration) -> tuple[Declared, ...]:
    """List the same where it is known, with a warning where it is not."""
    try:
        with importable_beside(configuration.file):  # as `check` does, so that the package need not be built
            return declared_by(configuration)
    except SolferError as error:
        _LOG.warning("warning: what '%s' declares is left out: %s", configuration.module.name, error)
        return ()


def _printed(owner: str, declaration: Declaration) -> Declared:
    interface = declaration.kind.__name__ if isinstance(declaration, Parameter) else declaration.interface
    kinds = {
        Service: "service",
        TopicIn: "topic in",
        TopicOut: "topic out",
        Action: "action",
        Parameter: "parameter",
    }
    return Declared(kinds[type(declaration)], full_name(owner, declaration.name), interface)
