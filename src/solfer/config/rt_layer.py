"""The file of an RT layer: which plugins run in real time, in which order, and what the executor lets pass.

The block `XBotRTPlugins` and `mwoibn.config_file` are those of XBotCore's own file; what else stands in such a file is
not read.
"""

import os
from dataclasses import dataclass, replace

from pydantic import Field

from solfer.config.configuration import Configuration
from solfer.config.files import check_file
from solfer.config.load import load
from solfer.config.record import Record, read
from solfer.config.search import Folders
from solfer.config.shared import Naming
from solfer.config.sources import FileRecord
from solfer.errors import ConfigError


class RtPluginsRecord(Record):
    """The block `XBotRTPlugins`."""

    plugins: tuple[str, ...] = Field(
        min_length=1, description="plugins in the order of their cycles: `plugin::configuration`, or `plugin` alone"
    )
    io_plugins: tuple[str, ...] = Field(
        default=(), deprecated="what goes to ROS and comes from there is the bridge's", description="obsolete"
    )


class RtMainRecord(Record):
    """The block `mwoibn`: where the plugins' configuration is."""

    config_file: FileRecord = Field(description="main configuration of the plugins")


class ScheduleRecord(Record):
    """What the process asks of the kernel; what is refused is reported, and does no harm."""

    priority: int = Field(default=60, ge=0, le=99, description="priority of SCHED_FIFO; 0: the ordinary scheduler")
    cpus: tuple[int, ...] = Field(default=(), description="processors that the process keeps to; none: all")
    lock_memory: bool = Field(default=True, description="whether no page may be swapped out")
    timer_slack: int = Field(default=1, ge=0, description="how much later the kernel may wake it [ns]; 0: as it is")
    cpu_latency: bool = Field(default=True, description="whether processors are kept out of deep sleep")
    freeze_collector: bool = Field(default=True, description="whether the garbage collector is off in the loop")


class ExecutorRecord(Record):
    """The block `executor`."""

    rate: float | None = Field(default=None, gt=0, description="cycles a second [Hz]; left out: that of the layer RT")
    start: tuple[str, ...] = Field(default=(), description="plugins that start by themselves, at the first cycle")
    blend: float = Field(default=2.0, ge=0, description="shortest time in which commands blend in at a start [s]")
    budget: float = Field(default=0.5, gt=0, le=1, description="share of the period that a component may take")
    overruns: int = Field(default=20, ge=1, description="overruns that are not forgiven, at which there is a stop")
    grace: int = Field(default=100, ge=0, description="first cycles in which overruns do not count")
    record: float = Field(default=10.0, ge=0, description="time that a recording in memory holds [s]; 0: there is none")
    schedule: ScheduleRecord = Field(default_factory=ScheduleRecord, description="what is asked of the kernel")


class _FileRecord(Record):
    """What is read of the file; everything else in it is XBotCore's."""

    model_config = Record.model_config | {"extra": "ignore"}

    executor: ExecutorRecord = Field(default_factory=ExecutorRecord, description="the executor of solfer")


@dataclass(frozen=True)
class RtLayer:
    """An RT layer.

    Attributes:
        record: Its plugins.
        main: Path of the main configuration of the plugins.
        executor: What the executor lets pass.
    """

    record: RtPluginsRecord
    main: str
    executor: ExecutorRecord

    def configurations(
        self, default: Naming = str, system: str | None = None, search_paths: Folders = ()
    ) -> list[tuple[str, Configuration]]:
        """Each plugin's name with its configuration, in the layer RT and for the middleware XBOT.

        Args:
            default: Gives the configuration of a plugin that is listed without one.
            system: `SM` or `HW` instead of what the main configuration says.
            search_paths: Folders where files are looked for that are not where the configuration says.

        Raises:
            SolferError: As `load`.
        """
        found = []
        for entry in self.record.plugins:
            plugin, _, name = entry.partition("::")
            loaded = load(self.main, name or default(plugin), system=system, search_paths=search_paths,
                          middleware="XBOT", layer="RT")
            found.append((plugin, replace(loaded, rate=self.executor.rate or loaded.rate)))
        return found


def read_layer(file: str | os.PathLike) -> RtLayer:
    """Read the file of an RT layer.

    Raises:
        ConfigError: It is missing or not YAML, or a value does not fit.
        UnknownName: A key that there is not.
        SolferErrors: Several of these.
    """
    record = read(file, RtPluginsRecord, ("XBotRTPlugins",))
    main = read(file, RtMainRecord, ("mwoibn",))
    executor = read(file, _FileRecord).executor
    path = main.config_file.location
    check_file(path, main.config_file.where("file") or main.where("config_file"))
    names = [entry.rpartition("::")[2] for entry in record.plugins]
    for name in executor.start:
        if name not in names:
            raise ConfigError(f"'{name}' starts by itself and is not among the plugins",
                              where=executor.where("start"), expected=f"one or more of {', '.join(names)}")
    return RtLayer(record, str(path), executor)
