"""Lists of plugins: the shared plugin, which runs several in one process (section 2.3 of the paper), and the RT layer.

Of the file of an RT layer the blocks `XBotRTPlugins` and `mwoibn.config_file` are those of XBotCore's own file, and
`executor` is that of solfer; all else in such a file is not read.
"""

import logging
import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layers import ROOT, Layers, ModulePlacement, location_of
from solfer.config.loading.load import Reading, load
from solfer.config.records.middlewares import RT
from solfer.config.records.modules import SharedRecord, is_shared
from solfer.config.records.pipes import ControllerRecord
from solfer.config.records.record import parse, read
from solfer.config.records.rt_layer import ExecutorRecord, RtFileRecord, RtMainRecord, RtPluginsRecord
from solfer.config.records.sources import TextRecord
from solfer.config.yaml.files import YamlFile, check_file, opened
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import ConfigError, SolferError, singles

_LOG = logging.getLogger(__name__)

Naming = Callable[[str], str]
"""The configuration that a plugin loads when the list names the plugin alone."""

Loading = Callable[..., Configuration]
"""Loads the configuration of a plugin: gets file, name, plugin, and the options of `load`."""


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
    problems.log(_LOG)
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
    named = listed(_entries(node, name, problems), node, layers, default=default, problems=problems)
    entries = [replace(entry, group=name) for entry in named]
    plugins = [_plugin(layers, entry, problems) for entry in entries]
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
    entry: YamlNode, plugin: str, name: str, layers: Layers, default: Naming, *, problems: Problems
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


def _load(file: YamlFile, name: str, plugin: str, **options: Any) -> Configuration:
    return load(file, name, **options)


@dataclass(frozen=True)
class RtLayer:
    """An RT layer.

    Attributes:
        record: Its list as it is written.
        main: Path of the main configuration of the plugins.
        executor: Limits and times of the executor.
        plugins: Its plugins in the order of their cycles; a shared plugin stands for all that it lists.
        start: Names of those that start by themselves.
        file: The main configuration, read.
        problems: Mistakes in the list.
    """

    record: RtPluginsRecord
    main: str
    executor: ExecutorRecord
    plugins: tuple[ListedPlugin, ...]
    start: tuple[str, ...]
    file: YamlFile = field(repr=False, compare=False)
    problems: Problems = field(repr=False, compare=False)

    def load(
        self,
        system: str | None = None,
        search_paths: Folders = (),
        load: Loading = _load,
    ) -> tuple[SharedPlugin, ...]:
        """Load the plugins, for the layer RT and its middleware.

        Args:
            system: `SM` or `HW` instead of the main configuration's `system`.
            search_paths: Folders to search for files that are not where the configuration expects them.
            load: Loads a configuration of a plugin; by default `load` without what only the plugin knows.

        Raises:
            ConfigError: Plugins have different rates, and the executor has none.
            UnknownName: A plugin requires another one that is not in the layer.
            SolferError: As `load`.
            SolferErrors: Several of these.
        """
        problems = Problems()
        found = list[SharedPlugin]()
        problems.absorb(self.problems)
        for entry in self.plugins:
            options = {"system": system, "search_paths": search_paths, "shared": entry.shared}
            try:
                read = load(self.file, entry.configuration, entry.plugin, middleware=RT.name, layer=RT.layer, **options)
                found.append(entry.loaded(read))
            except SolferError as error:
                for each in singles([error]):
                    problems.put(entry.mark, each)
        check_group(
            found,
            [each.name for each in self.plugins],
            "the RT layer",
            problems=problems,
            one_rate=self.executor.rate is None,
        )
        problems.log(_LOG)
        problems.raise_if_any()
        return tuple(self._paced(plugin) for plugin in found)

    def at(self, rate: float) -> "RtLayer":
        """Return the same layer at another rate [Hz]."""
        return replace(self, executor=self.executor.model_copy(update={"rate": rate}))

    def _paced(self, plugin: SharedPlugin) -> SharedPlugin:
        """Return a plugin with the rate of the executor, if that has one."""
        rate = self.executor.rate or plugin.configuration.rate
        return replace(plugin, configuration=replace(plugin.configuration, rate=rate))


def read_layer(file: str | os.PathLike, default: Naming = str) -> RtLayer:
    """Read the file of an RT layer; a main configuration stands for the one that its `xbot.source.config` names.

    Args:
        file: The file, also one that was read before.
        default: Returns the configuration of a plugin that is listed without one.

    Raises:
        ConfigError: It is missing or not YAML, or a value does not fit.
        UnknownName: A key is not known.
        SolferErrors: Several of these.
    """
    given = opened(file)
    own = _layer_of(given)
    _refuse_main(own)
    record = read(own, RtPluginsRecord, ("XBotRTPlugins",))
    main = read(own, RtMainRecord, ("mwoibn",))
    executor = read(own, RtFileRecord).executor
    path = main.config_file.location
    named = main.config_file.where("file") or main.where("config_file")
    check_file(path, named)
    problems = Problems()
    known = given if given is not own and os.path.samefile(path, given) else own.other(path, named)
    layers = Layers(known, problems)
    _refuse_ros_alone(layers.main, record, known.path)
    entries: Any = own.node.nearest(("XBotRTPlugins", "plugins")).value
    plugins = listed(entries, None, layers, default=default, problems=problems)
    start = _start(executor, record, plugins, main=layers.main)
    return RtLayer(record, str(path), executor, plugins=tuple(plugins), start=start, file=known, problems=problems)


def _start(
    executor: ExecutorRecord, record: RtPluginsRecord, plugins: Sequence[ListedPlugin], main: YamlNode
) -> tuple[str, ...]:
    """Return the names of the plugins that start by themselves; a shared plugin stands for all that it lists.

    Raises:
        ConfigError: One of them is not in the layer.
    """
    groups: dict[str, list[str]] = {entry.rpartition("::")[2]: [] for entry in record.plugins}
    for plugin in plugins:
        group = plugin.shared.head.path[-1] if plugin.shared is not None else plugin.plugin
        groups.setdefault(str(group), []).append(plugin.name)
    names = groups | {plugin.name: [plugin.name] for plugin in plugins}
    for index, name in enumerate(executor.start):
        if name not in names:
            raise ConfigError(
                f"'{name}' starts by itself and is not among the plugins",
                where=executor.where("start", index),
                expected=f"one or more of {', '.join(names)}",
            )
    return tuple(dict.fromkeys(each for name in executor.start for each in names[name]))


def read_once(file: str | os.PathLike) -> str | os.PathLike:
    """Return a file, read if that can be done, so that what follows does not read it again."""
    try:
        return opened(file)
    except SolferError:
        return file


def is_layer(file: str | os.PathLike) -> bool:
    """Return whether a file is that of an RT layer, and not a main configuration; no error if it cannot be read."""
    try:
        node = opened(file).node
    except SolferError:
        return False
    return node.get("XBotRTPlugins") is not None and node.get(*ROOT, "modules") is None


def _refuse_main(file: YamlFile) -> None:
    """Refuse a main configuration that names no RT layer.

    Raises:
        ConfigError: It is one.
    """
    modules = file.node.get(*ROOT, "modules")
    if modules is not None and file.node.get("XBotRTPlugins") is None:
        raise ConfigError(
            "this is a main configuration, and not an RT layer: there is no 'XBotRTPlugins' in it",
            where=str(modules.head),
            expected="the file of an RT layer, or one named by 'xbot.source.config'; "
            f"`rosrun plugins plugin -p ID -c {shlex.quote(file.path)}` runs a plugin of this one on ROS",
        )


def _refuse_ros_alone(main: YamlNode, record: RtPluginsRecord, file: str) -> None:
    """Refuse a main configuration whose plugins are for ROS alone.

    Raises:
        ConfigError: It says `middleware: ROS`, and has no part for XBOT.
    """
    middleware = main.get("middleware")
    if middleware is None or middleware.value == RT.name or main.get(RT.section) is not None:
        return
    plugin, _, name = record.plugins[0].partition("::")
    chosen = f" -n {shlex.quote(name)}" if name else ""
    raise ConfigError(
        f"the plugins of this file are for ROS alone, and the RT layer lists '{record.plugins[0]}' at "
        f"{record.where('plugins', 0)}",
        where=str(middleware.mark),
        expected="a block `xbot` with the part of the pipes in it, or "
        f"`rosrun plugins plugin -p {shlex.quote(plugin)}{chosen} -c {shlex.quote(file)}` in place of this node",
    )


def _layer_of(file: YamlFile) -> YamlFile:
    """Return the file of the layer that a main configuration names; any other file stands for itself."""
    named = file.node.get(*ROOT, RT.section, "source", "config")
    if file.node.get("XBotRTPlugins") is not None or named is None:
        return file
    problems = Problems()
    record = parse(named, TextRecord, problems)
    path = location_of(record, problems) if record is not None else None
    problems.raise_if_any()
    return file if path is None else file.other(path, record.where("file"))
