"""The shared plugin, which runs several in one process (section 2.3 of the paper)."""

import logging
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layers import Layers, ModulePlacement
from solfer.config.loading.listed_plugins import ListedPlugin, Naming, SharedPlugin, entries_of, listed
from solfer.config.loading.load import Reading
from solfer.config.records.modules import SharedRecord, is_shared
from solfer.config.records.record import parse
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class SharedConfiguration:
    """A shared plugin.

    Attributes:
        record: Its own keys.
        plugins: Its plugins, in the order of the list, which is the order of their cycles. All have one rate.
    """

    record: SharedRecord
    plugins: tuple[SharedPlugin, ...]

    @property
    def configurations(self) -> tuple[Configuration, ...]:
        """The configurations of the plugins, in the order of the list."""
        return tuple(plugin.configuration for plugin in self.plugins)

    def at(self, rate: float) -> "SharedConfiguration":
        """Return the same plugins at another rate [Hz]."""
        paced = (replace(each, configuration=each.configuration.at(rate)) for each in self.plugins)
        return replace(self, plugins=tuple(paced))


def load_shared(
    file: str | os.PathLike,
    name: str = "shared",
    *,
    default: Naming = str,
    system: str | None = None,
    search_paths: Folders = (),
    over: YamlNode | None = None,
) -> SharedConfiguration:
    """Load a shared plugin with all plugins that it lists.

    Its layer chooses the layer's file for all of them, and its mode `idle` makes all of them idle. A configuration that
    is listed again gets a name of its own, which is logged.

    Args:
        file: The main configuration.
        name: Name of the shared plugin's configuration.
        default: Returns the configuration of a plugin that is listed without one; by default that of the same name.
        system: `SM` or `HW` instead of the file's `system`.
        search_paths: Folders to search for files that are not where the configuration expects them.
        over: What is laid over all files in the end; None: nothing.

    Raises:
        ConfigError: A file is missing or not YAML, a value does not fit, the module is not a shared plugin, or its
            plugins have different rates.
        UnknownName: A key, module, set, pipe or robot configuration does not exist, or a plugin requires another one
            that is not in the list.
        SolferErrors: Several of these; all mistakes are reported at once.
    """
    problems = Problems()
    layers = Layers(file, problems, system, folders=search_paths, over=over)
    shared = read_shared(layers, name, default, problems)
    problems.log(logger)
    problems.raise_if_any()
    return shared


def read_shared(layers: Layers, name: str, default: Naming, problems: Problems) -> SharedConfiguration | None:
    """Load a shared plugin as `load_shared` does; mistakes go to `problems`, and then the result may be None.

    Raises:
        UnknownName: There is no module of that name.
        ConfigError: The module is empty.
    """
    node = layers.module(name)
    if not is_shared(name, node):
        problems.add(node.head, f"'{name}' lists no plugins", "a shared plugin: `layer` and `plugins`")
        return None
    record = parse(node, SharedRecord, problems, name=name)
    if record is None:
        return None
    named = listed(entries_of(node, name, problems), node, layers, default=default, problems=problems)
    entries = [replace(entry, group=name) for entry in named]
    plugins = [_plugin(layers, entry, problems) for entry in entries]
    found = tuple(plugin for plugin in plugins if plugin is not None)
    check_group(found, [entry.name for entry in entries], f"the shared plugin '{name}'", problems=problems)
    return None if problems else SharedConfiguration(record, found)


def check_group(
    plugins: Sequence[SharedPlugin], names: Sequence[str], group: str, problems: Problems, one_rate: bool = True
) -> None:
    """Check what plugins of one group have to have in common: one rate, and the components that they require.

    Args:
        plugins: The plugins that could be loaded.
        names: Names of all plugins of the group.
        group: Name of the group for messages.
        problems: Receives the mistakes.
        one_rate: Whether their rates count.
    """
    for plugin in plugins:
        _check_required(plugin, names, group, problems=problems)
        if one_rate and plugin.configuration.rate != plugins[0].configuration.rate:
            _note_rates(plugins[0], plugin, group, problems=problems)


def _check_required(plugin: SharedPlugin, names: Sequence[str], group: str, problems: Problems) -> None:
    """Check that the components that one requires are others of its group."""
    others = [name for name in names if name != plugin.name]
    for index, name in enumerate(plugin.requires):
        mark = plugin.configuration.module.place("requires", index)
        if name == plugin.name:
            problems.add(mark, f"'{name}' requires itself", "names of other components of the group")
        elif name not in others:
            problems.unknown(mark, f"component of {group}", name, others)


def _note_rates(first: SharedPlugin, other: SharedPlugin, group: str, problems: Problems) -> None:
    """Note that two plugins of a group have different rates, at the place of the later one's."""
    one = first.configuration
    another = other.configuration
    problems.add(
        another.tree.nearest(("robot", "rate")).mark,
        f"'{other.name}' has {another.rate:g} Hz, and '{first.name}' {one.rate:g} Hz, in {group}",
        f"one rate for all of them; that of '{first.name}' is at {one.where('robot', 'rate')}",
    )


def _plugin(layers: Layers, entry: ListedPlugin, problems: Problems) -> SharedPlugin | None:
    """Load the plugin of an entry; None after a mistake."""
    found = Problems()
    try:
        reading = Reading(layers, entry.configuration, found, ModulePlacement(shared=entry.shared))
        configuration = reading.configuration()
    except SolferError as error:
        problems.put(entry.mark, error)
        return None
    problems.absorb(found)
    return None if configuration is None else entry.loaded(configuration)
