"""The list of the RT layer.

Of its file the blocks `XBotRTPlugins` and `mwoibn.config_file` are those of XBotCore's own file, and `executor` is that
of solfer; all else is not read.
"""

import logging
import os
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layers import ROOT, Layers, location_of
from solfer.config.loading.listed_plugins import ListedPlugin, Naming, SharedPlugin, listed
from solfer.config.loading.load import load
from solfer.config.loading.shared import check_group
from solfer.config.records.middlewares import RT
from solfer.config.records.record import parse, read
from solfer.config.records.rt_layer import ExecutorRecord, RtFileRecord, RtMainRecord, RtPluginsRecord
from solfer.config.records.sources import TextRecord
from solfer.config.yaml.files import YamlFile, check_file, opened
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import ConfigError, SolferError, singles

logger = logging.getLogger(__name__)

Loading = Callable[..., Configuration]
"""Loads the configuration of a plugin: gets file, name, plugin, and the options of `load`."""


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
        problems.log(logger)
        problems.raise_if_any()
        return tuple(self._paced(plugin) for plugin in found)

    def at(self, rate: float) -> "RtLayer":
        """Return the same layer at another rate [Hz]."""
        return replace(self, executor=self.executor.model_copy(update={"rate": rate}))

    def _paced(self, plugin: SharedPlugin) -> SharedPlugin:
        """Return a plugin with the rate of the executor, if that has one."""
        return replace(plugin, configuration=plugin.configuration.at(self.executor.rate or plugin.configuration.rate))


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
