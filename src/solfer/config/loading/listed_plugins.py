"""Entries of lists of plugins, each with a name that no other one has."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layers import Layers
from solfer.config.records.modules import SharedRecord, is_shared
from solfer.config.records.pipes import ControllerRecord
from solfer.config.records.record import parse
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.problems import Problems

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

    def loaded(self, configuration: Configuration) -> "SharedPlugin":
        """Return the plugin with its configuration, under the name of this entry, which its topics follow."""
        module = configuration.module.model_copy(update={"name": self.name})
        named = replace(configuration, module=module)
        named = replace(named, controllers=tuple(_named_topic(pipe, named) for pipe in named.controllers))
        return SharedPlugin(
            self.plugin, self.name, module.requires, configuration=named, where=str(self.mark), group=self.group
        )


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


def entries_of(node: YamlNode, name: str, problems: Problems) -> Iterator[YamlNode]:
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
    entry: YamlNode, plugin: str, name: str, layers: Layers, default: Naming, *, problems: Problems
) -> Iterator[ListedPlugin]:
    """Yield the plugins of a shared plugin that is listed in an RT layer."""
    node = layers.main.nearest(("modules", name))
    if plugin not in ("shared", name):
        problems.add(entry.mark, f"'{name}' lists plugins and is not one itself", f"`shared::{name}`")
    elif parse(node, SharedRecord, problems, name=name) is not None:
        for inner in entries_of(node, name, problems):
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
