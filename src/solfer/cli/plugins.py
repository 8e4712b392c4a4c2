"""Plugin configurations of a file, as the commands take them."""

from collections.abc import Iterator, Sequence

from solfer.cli.diagram import Network, connect, robot_groups
from solfer.config import Configuration, Report, check
from solfer.errors import raise_all
from solfer.plugins.registry import BUILT_IN, Registry


def configurations_of(report: Report) -> Iterator[Configuration]:
    """All plugins of a report, also those that shared plugins list, each once."""
    found: dict[str, Configuration] = {}
    for name in report.modules:
        listed = report.shared[name].configurations if name in report.shared else (report.configurations[name],)
        for configuration in listed:
            found.setdefault(configuration.module.name, configuration)
    return iter(found.values())


def component_of(configuration: Configuration) -> str:
    """Name of the component that a configuration asks for."""
    module = configuration.module
    target = module.class_ or (BUILT_IN[module.name].target if module.name in BUILT_IN else module.name)
    return target.rpartition(":")[2]


def network_of(
    file: str, names: Sequence[str], system: str | None = None, search_paths: Sequence[str] = ()
) -> Network:
    """The plugins of a file, and how their pipes connect them; see `check` for the arguments.

    Raises:
        SolferError: One of the configurations is wrong.
        SolferErrors: Several mistakes.
    """
    report = check(file, names, search_paths=search_paths, system=system, default=Registry().configuration)
    raise_all(report.errors)
    configurations = list(configurations_of(report))
    shared = {name: robot_groups(each.configurations) for name, each in report.shared.items()}
    return connect(configurations, [component_of(each) for each in configurations], shared)
