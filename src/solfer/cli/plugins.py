"""Plugin configurations of a file, as the commands take them."""

from collections.abc import Sequence

from solfer.cli.diagram import Network, connect
from solfer.config import Configuration, load
from solfer.errors import SolferError, SolferErrors, raise_all
from solfer.plugins.registry import BUILT_IN


def load_all(file: str, names: Sequence[str], system: str | None = None) -> list[Configuration]:
    """The configurations of those names, each once.

    Raises:
        SolferErrors: What is wrong with any of them.
    """
    configurations, faults = [], {}
    for name in dict.fromkeys(names):
        try:
            configurations.append(load(file, name, system=system))
        except SolferErrors as error:
            faults |= {str(single): single for single in error.errors}
        except SolferError as error:
            faults[str(error)] = error
    raise_all(list(faults.values()))
    return configurations


def component_of(configuration: Configuration) -> str:
    """Name of the component that a configuration asks for."""
    module = configuration.module
    target = module.class_ or (BUILT_IN[module.name].target if module.name in BUILT_IN else module.name)
    return target.rpartition(":")[2]


def network_of(file: str, names: Sequence[str], system: str | None = None) -> Network:
    """The plugins of a file and how their pipes connect them."""
    configurations = load_all(file, names, system)
    return connect(configurations, [component_of(each) for each in configurations])
