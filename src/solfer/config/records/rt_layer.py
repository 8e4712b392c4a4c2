"""Records of the file of an RT layer: its list of plugins, and the limits that the executor sets."""

from typing import Annotated

from pydantic import Field

from solfer.config.records.bounds import COUNT, DURATION, RATE
from solfer.config.records.record import Record
from solfer.config.records.sources import FileRecord


class RtPluginsRecord(Record):
    """The block `XBotRTPlugins`."""

    plugins: tuple[str, ...] = Field(
        min_length=1,
        description="plugins in the order of their cycles: `plugin::configuration`, or `plugin` alone; "
        "a shared plugin stands for all that it lists",
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
    budget: float = Field(default=0.5, ge=0.01, le=1, description="fraction of the period that a component may take")
    overruns: int = Field(
        default=20,
        ge=1,
        le=1_000_000,
        description="cycles too long, not forgiven, at which the plugin or the loop is stopped",
    )
    grace: int = Field(default=100, **COUNT, description="first cycles in which overruns do not count")
    record: float = Field(
        default=10.0, ge=0, le=600, description="length of the recording in memory [s]; 0: no recording"
    )
    schedule: ScheduleRecord = Field(default_factory=ScheduleRecord, description="requests to the kernel")


class RtFileRecord(Record):
    """The part of the file of an RT layer that is read; everything else in it is XBotCore's."""

    model_config = Record.model_config | {"extra": "ignore"}

    executor: ExecutorRecord = Field(default_factory=ExecutorRecord, description="the executor of solfer")
