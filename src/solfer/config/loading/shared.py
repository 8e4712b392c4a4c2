"""The shared plugin: several plugins that run in one process, one after the other (section 2.3 of the paper)."""

import logging
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layering import Layers, ModulePlacement
from solfer.config.loading.reading import Reading
from solfer.config.records.modules import SharedRecord, is_shared
from solfer.config.records.pipes import ControllerRecord
from solfer.config.records.record import parse
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError

_LOG = logging.getLogger(__name__)

Naming = Callable[[str], str]
"""The configuration that a plugin loads when the list names the plugin alone."""


@dataclass(frozen=True)
class ListedPlugin:
    """One entry of a list of plugins, before its configuration is loaded.

    Attributes:
        plugin: Name of the plugin.
        configuration: Name of its configuration.
        name: Name of the component, which no other one of the list has: that of the configuration, or with a number
            behind it. Services, claims, statistics and topics that it publishes follow it.
        mark: Place of the entry.
        shared: The shared plugin whose list the entry stands in; None: the list of an RT layer.
        group: Name of that shared plugin; empty: none.
    """

    plugin: str
    configuration: str
    name: str
    mark: Mark
    shared: YamlNode | None = None
    group: str = ""

    def named(self, configuration: Configuration) -> Configuration:
        """Return the loaded configuration with the name of this entry, which its topics follow."""
        module = configuration.module
        named = replace(configuration, module=module.model_copy(update={"name": self.name}))
        return replace(named, controllers=tuple(_named_topic(pipe, named) for pipe in named.controllers))


@dataclass(frozen=True)
class SharedPlugin:
    """A plugin of a list, loaded.

    Attributes:
        plugin: Name of the plugin.
        name: Name of the component, which no other one of the list has; also `configuration.module.name`.
        requires: Names of the components of the list that it needs: where one of them stops, it stops with it.
        configuration: Its configuration, in the layer of the shared plugin.
        where: Place of the entry.
        group: Name of the shared plugin that lists it; empty: an RT layer lists it by itself.
    """

    plugin: str
    name: str
    requires: tuple[str, ...]
    configuration: Configuration
    where: str
    group: str = ""


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
    shared = read_shared(layers, os.fspath(file), name, default=default, problems=problems)
    problems.log(_LOG)
    problems.raise_if_any()
    return shared


def read_shared(
    layers: Layers, file: str, name: str, default: Naming, problems: Problems
) -> SharedConfiguration | None:
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
    named = listed(_entries(node, name, problems), node, layers, default=default, problems=problems)
    entries = [replace(entry, group=name) for entry in named]
    plugins = [_plugin(layers, file, entry, problems=problems) for entry in entries]
    found = tuple(plugin for plugin in plugins if plugin is not None)
    check_group(found, [entry.name for entry in entries], f"the shared plugin '{name}'", problems=problems)
    return None if problems else SharedConfiguration(record, found)


def listed(
    entries: Iterable[YamlNode], shared: YamlNode | None, layers: Layers, default: Naming, problems: Problems
) -> list[ListedPlugin]:
    """Return the plugins of a list in its order, each with a name that no other one has.

    Args:
        entries: The entries: `plugin::configuration`, or `plugin` alone.
        shared: The shared plugin whose list it is. None: that of an RT layer, in which a shared plugin stands for all
            that it lists.
        layers: The main configuration.
        default: Returns the configuration of a plugin that is listed without one.
        problems: Receives the mistakes, and what is worth knowing: names that are made unique.
    """
    found = [each for entry in entries for each in _named(entry, shared, layers, default=default, problems=problems)]
    return _made_unique(found, problems)


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


def _entries(node: YamlNode, name: str, problems: Problems) -> Iterator[YamlNode]:
    """Yield the entries of a shared plugin whose record is correct."""
    entries: Any = node.get("plugins").value if node.get("plugins") else ()
    if not entries:
        problems.warn(node.head, f"'{name}' lists no plugins, so it runs nothing")
    yield from entries


def _named(
    entry: YamlNode, shared: YamlNode | None, layers: Layers, default: Naming, problems: Problems
) -> Iterator[ListedPlugin]:
    """Yield the plugin that an entry names, or all that the shared plugin lists that it names."""
    plugin, separator, name = str(entry.value).partition("::")
    if not plugin or (separator and not name):
        problems.add(entry.mark, f"'{entry.value}' names no plugin", "`plugin::configuration`, or `plugin` alone")
        return
    name = name or default(plugin)
    if name not in layers.names:
        kind = "plugin" if name == plugin else f"configuration of the plugin '{plugin}':"
        problems.unknown(entry.mark, kind, name, layers.names)
    elif shared is None and is_shared(name, layers.main.nearest(("modules", name))):
        yield from _expanded(entry, plugin, name, layers=layers, default=default, problems=problems)
    else:
        yield ListedPlugin(plugin, name, name, mark=entry.mark, shared=shared)


def _expanded(
    entry: YamlNode, plugin: str, name: str, layers: Layers, default: Naming, problems: Problems
) -> Iterator[ListedPlugin]:
    """Yield the plugins of a shared plugin that is listed in an RT layer."""
    node = layers.main.nearest(("modules", name))
    if plugin not in ("shared", name):
        problems.add(entry.mark, f"'{name}' lists plugins and is not one itself", f"`shared::{name}`")
    elif parse(node, SharedRecord, problems, name=name) is not None:
        for inner in _entries(node, name, problems):
            yield from (
                replace(each, group=name) for each in _named(inner, node, layers, default=default, problems=problems)
            )


def _made_unique(plugins: Sequence[ListedPlugin], problems: Problems) -> list[ListedPlugin]:
    """Give plugins whose configuration stands in the list again a name with a number."""
    own = {plugin.name for plugin in plugins}
    taken = set[str]()
    found = list[ListedPlugin]()
    for plugin in plugins:
        name = plugin.name
        number = 2
        while name in taken or (name in own and name != plugin.name):
            name = f"{plugin.name}_{number}"
            number = number + 1
        taken.add(name)
        if name != plugin.name:
            what = (
                f"'{plugin.name}' stands in the list again: here it is named '{name}', as are its services; "
                "its topics get the same number"
            )
            problems.inform(plugin.mark, what)
        found.append(replace(plugin, name=name))
    return found


def _named_topic(pipe: ControllerRecord, configuration: Configuration) -> ControllerRecord:
    """Return a pipe of a configuration with the topic that follows its name; one to the lower level stays."""
    if pipe.sink is None or pipe.lower_level:
        return pipe
    return pipe.model_copy(update={"sink": configuration.own_topic(pipe.sink)})


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


def _plugin(layers: Layers, file: str, entry: ListedPlugin, problems: Problems) -> SharedPlugin | None:
    """Load the plugin of an entry; None after a mistake."""
    found = Problems()
    name = entry.configuration
    try:
        configuration = Reading(layers.tree(name, found, ModulePlacement(shared=entry.shared)), found).configuration(
            file, name
        )
    except SolferError as error:
        problems.put(entry.mark, error)
        return None
    problems.absorb(found)
    return None if configuration is None else loaded(entry, configuration)


def loaded(entry: ListedPlugin, configuration: Configuration) -> SharedPlugin:
    """Return the plugin of an entry with its configuration, under its unique name."""
    named = entry.named(configuration)
    return SharedPlugin(
        entry.plugin, entry.name, named.module.requires, configuration=named, where=str(entry.mark), group=entry.group
    )
