"""The shared plugin: several plugins that run in one process, one after the other (section 2.3 of the paper)."""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layering import Layers
from solfer.config.loading.reading import Reading
from solfer.config.records.modules import SharedRecord, is_shared
from solfer.config.records.record import parse
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import SolferError

_LOG = logging.getLogger(__name__)

Naming = Callable[[str], str]
"""The configuration that a plugin loads when the list names the plugin alone."""


@dataclass(frozen=True)
class SharedPlugin:
    """One entry of a shared plugin's list.

    Attributes:
        plugin: Name of the plugin.
        configuration: Its configuration, in the layer of the shared plugin.
        where: Place of the entry.
    """

    plugin: str
    configuration: Configuration
    where: str


@dataclass(frozen=True)
class SharedConfiguration:
    """A shared plugin.

    Attributes:
        record: Its own keys.
        plugins: Its plugins, in the order of the list.
    """

    record: SharedRecord
    plugins: tuple[SharedPlugin, ...]

    @property
    def configurations(self) -> tuple[Configuration, ...]:
        """The configurations of the plugins, in the order of the list."""
        return tuple(plugin.configuration for plugin in self.plugins)


def load_shared(
    file: str | os.PathLike,
    name: str = "shared",
    *,
    default: Naming = str,
    system: str | None = None,
    search_paths: Folders = (),
) -> SharedConfiguration:
    """Load a shared plugin with all plugins that it lists.

    Its layer chooses the layer's file for all of them, and its mode `idle` makes all of them idle.

    Args:
        file: The main configuration.
        name: Name of the shared plugin's configuration.
        default: Returns the configuration of a plugin that is listed without one; by default that of the same name.
        system: `SM` or `HW` instead of the file's `system`.
        search_paths: Folders to search for files that are not where the configuration expects them.

    Raises:
        ConfigError: A file is missing or not YAML, a value does not fit, or the module is not a shared plugin.
        UnknownName: A key, module, set, pipe or robot configuration does not exist.
        SolferErrors: Several of these; all mistakes are reported at once.
    """
    problems = Problems()
    layers = Layers(file, problems, system, search_paths)
    shared = read_shared(layers, os.fspath(file), name, default, problems)
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
    if not record.plugins:
        problems.warn(node.head, f"'{name}' lists no plugins, so it runs nothing")
    entries: Any = node.get("plugins").value if record.plugins else ()
    _check_once(entries, default, problems)
    plugins = [_plugin(layers, file, entry, node, default, problems) for entry in entries]
    return None if None in plugins else SharedConfiguration(record, tuple(plugins))


def _check_once(entries: Sequence[YamlNode], default: Naming, problems: Problems) -> None:
    """Check that no configuration is listed twice."""
    first: dict[str, YamlNode] = {}
    for entry in entries:
        plugin, _, name = entry.value.partition("::")
        name = name or default(plugin)
        if first.setdefault(name, entry) is not entry:
            problems.add(entry.mark, f"the plugin '{name}' stands twice", f"only the one in {first[name].mark}")


def _plugin(
    layers: Layers, file: str, entry: YamlNode, shared: YamlNode, default: Naming, problems: Problems
) -> SharedPlugin | None:
    plugin, separator, name = entry.value.partition("::")
    if not plugin or (separator and not name):
        problems.add(entry.mark, f"'{entry.value}' names no plugin", "`plugin::configuration`, or `plugin` alone")
        return None
    name = name or default(plugin)
    if name not in layers.names:
        problems.unknown(entry.mark, f"configuration of the plugin '{plugin}':", name, layers.names)
        return None
    found = Problems()
    try:
        configuration = Reading(layers.tree(name, found, shared), found).configuration(file, name)
    except SolferError as error:
        problems.put(entry.mark, error)
        return None
    problems.absorb(found)
    return None if configuration is None else SharedPlugin(plugin, configuration, str(entry.mark))
