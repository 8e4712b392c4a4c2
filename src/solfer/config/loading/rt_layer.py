"""The file of an RT layer: the plugins that run in real time, their order, and the limits that the executor sets.

The block `XBotRTPlugins` and `mwoibn.config_file` are those of XBotCore's own file; all else in such a file is
not read.
"""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

from pydantic import Field

from solfer.config.loading.configuration import Configuration
from solfer.config.loading.layering import ROOT, location_of
from solfer.config.loading.load import load as load_module
from solfer.config.loading.shared import Naming
from solfer.config.records.bounds import COUNT, DURATION, RATE
from solfer.config.records.record import Record, parse, read
from solfer.config.records.sources import FileRecord, TextRecord
from solfer.config.yaml.files import check_file, read_node
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import Folders
from solfer.errors import ConfigError, SolferError, raise_all, singles

Loading = Callable[..., Configuration]
"""Loads the configuration of a plugin: gets file, name, plugin, and the options of `load`."""


class RtPluginsRecord(Record):
    """The block `XBotRTPlugins`."""

    plugins: tuple[str, ...] = Field(
        min_length=1, description="plugins in the order of their cycles: `plugin::configuration`, or `plugin` alone"
    )
    io_plugins: tuple[str, ...] = Field(
        default=(), deprecated="the bridge connects the layer to ROS", description="obsolete"
    )


class RtMainRecord(Record):
    """The block `mwoibn`: where the plugins' configuration is."""

    config_file: FileRecord = Field(description="main configuration of the plugins")


class ScheduleRecord(Record):
    """Requests of the process to the kernel; refused ones are reported, and do no harm."""

    priority: int = Field(
        default=60,
        ge=0,
        le=90,
        description="priority of SCHED_FIFO; 0: the ordinary scheduler; above 90 are threads that the kernel needs",
    )
    cpus: tuple[Annotated[int, Field(ge=0, le=4095)], ...] = Field(
        default=(), description="processors that the process keeps to, as far as they exist; empty: all"
    )
    lock_memory: bool = Field(default=True, description="whether no page may be swapped out")
    timer_slack: int = Field(default=1, **COUNT, description="how much later the kernel may wake it [ns]; 0: unchanged")
    cpu_latency: bool = Field(default=True, description="whether processors are kept out of deep sleep")
    freeze_collector: bool = Field(default=True, description="whether the garbage collector is off in the loop")


class ExecutorRecord(Record):
    """The block `executor`."""

    rate: float | None = Field(default=None, **RATE, description="cycles a second [Hz]; left out: that of the layer RT")
    start: tuple[str, ...] = Field(default=(), description="plugins that start by themselves, at the first cycle")
    blend: float = Field(default=2.0, **DURATION, description="shortest time in which commands blend in at a start [s]")
    budget: float = Field(default=0.5, ge=0.01, le=1, description="share of the period that a component may take")
    overruns: int = Field(
        default=20, ge=1, le=1_000_000, description="overruns, not forgiven, at which the plugin or the loop is stopped"
    )
    grace: int = Field(default=100, **COUNT, description="first cycles in which overruns do not count")
    record: float = Field(
        default=10.0, ge=0, le=600, description="length of the recording in memory [s]; 0: no recording"
    )
    schedule: ScheduleRecord = Field(default_factory=ScheduleRecord, description="requests to the kernel")


class _FileRecord(Record):
    """The part of the file that is read; everything else in it is XBotCore's."""

    model_config = Record.model_config | {"extra": "ignore"}

    executor: ExecutorRecord = Field(default_factory=ExecutorRecord, description="the executor of solfer")


@dataclass(frozen=True)
class RtLayer:
    """An RT layer.

    Attributes:
        record: Its plugins.
        main: Path of the main configuration of the plugins.
        executor: Limits and times of the executor.
    """

    record: RtPluginsRecord
    main: str
    executor: ExecutorRecord

    def configurations(
        self,
        default: Naming = str,
        system: str | None = None,
        search_paths: Folders = (),
        load: Loading | None = None,
    ) -> list[tuple[str, Configuration]]:
        """Load each plugin's configuration, in the layer RT and for the middleware XBOT; each with its plugin's name.

        Args:
            default: Returns the configuration of a plugin that is listed without one.
            system: `SM` or `HW` instead of the main configuration's `system`.
            search_paths: Folders to search for files that are not where the configuration expects them.
            load: Loads a configuration of a plugin; None: `load` without what only the plugin knows.

        Raises:
            ConfigError: A configuration is listed twice.
            SolferError: As `load`.
            SolferErrors: Several of these.
        """
        faults: list[SolferError] = []
        found: list[tuple[str, Configuration]] = []
        for plugin, name in self.entries(default, faults):
            try:
                loaded = (load or _load)(
                    self.main, name, plugin, system=system, search_paths=search_paths, middleware="XBOT", layer="RT"
                )
                found.append((plugin, replace(loaded, rate=self.executor.rate or loaded.rate)))
            except SolferError as error:
                faults += singles([error])
        raise_all(faults)
        return found

    def entries(self, default: Naming, faults: list[SolferError]) -> Iterator[tuple[str, str]]:
        """Yield the name of each plugin with that of its configuration; those listed twice are added to `faults`."""
        names: dict[str, int] = {}
        for index, entry in enumerate(self.record.plugins):
            plugin, _, name = entry.partition("::")
            name = name or default(plugin)
            first = names.setdefault(name, index)
            if first == index:
                yield plugin, name
                continue
            faults.append(
                ConfigError(
                    f"the plugin '{name}' stands twice",
                    where=self.record.where("plugins", index),
                    expected=f"only the one in {self.record.where('plugins', first)}",
                )
            )


def _load(file: str, name: str, plugin: str, **options: Any) -> Configuration:
    return load_module(file, name, **options)


def read_layer(file: str | os.PathLike) -> RtLayer:
    """Read the file of an RT layer; a main configuration stands for the one that its `xbot.source.config` names.

    Raises:
        ConfigError: It is missing or not YAML, or a value does not fit.
        UnknownName: A key is not known.
        SolferErrors: Several of these.
    """
    file = _layer_of(file)
    record = read(file, RtPluginsRecord, ("XBotRTPlugins",))
    main = read(file, RtMainRecord, ("mwoibn",))
    executor = read(file, _FileRecord).executor
    path = main.config_file.location
    check_file(path, main.config_file.where("file") or main.where("config_file"))
    names = [entry.rpartition("::")[2] for entry in record.plugins]
    for name in executor.start:
        if name not in names:
            raise ConfigError(
                f"'{name}' starts by itself and is not among the plugins",
                where=executor.where("start"),
                expected=f"one or more of {', '.join(names)}",
            )
    return RtLayer(record, str(path), executor)


def is_layer(file: str | os.PathLike) -> bool:
    """Return whether a file is that of an RT layer, and not a main configuration; no error if it cannot be read."""
    try:
        node = read_node(file, Problems())
    except SolferError:
        return False
    return node.get("XBotRTPlugins") is not None and node.get(*ROOT, "modules") is None


def _layer_of(file: str | os.PathLike) -> str | os.PathLike:
    """Return the file of the layer that a main configuration names; any other file stands for itself."""
    node = read_node(file, Problems())
    named = node.get(*ROOT, "xbot", "source", "config")
    if node.get("XBotRTPlugins") is not None or named is None:
        return file
    problems = Problems()
    record = parse(named, TextRecord, problems)
    path = location_of(record, problems) if record is not None else None
    problems.raise_if_any()
    return file if path is None else path
