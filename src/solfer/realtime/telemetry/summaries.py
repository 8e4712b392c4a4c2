"""Summaries of an RT layer's statistics, read repeatedly from outside."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.telemetry.histograms import Histograms
from solfer.realtime.telemetry.statistics_memory import LOOP_HISTOGRAMS, LoopCount, PluginCount, RuntimeStatistics

LOOP_COUNTS = (LoopCount.CYCLES, LoopCount.SKIPPED, LoopCount.OVERRUNS, LoopCount.UNFORGIVEN)


@dataclass(frozen=True)
class StageSummary:
    """Times of a stage.

    Attributes:
        name: Name of the stage.
        count: Number of cycles in which it was reached, since the start.
        median, p99: Quantiles of its times since the last `look` [s].
        longest: Longest time since the start [s].
        skipped: Periods that were skipped because of it, since the start.
    """

    name: str
    count: int
    median: float
    p99: float
    longest: float
    skipped: int


@dataclass(frozen=True)
class PluginSummary:
    """A plugin: state of its life and the reason, counts since the start, and the stages of its cycle.

    `computed` says how often each quantity of its Robot was computed, by whichever plugin shares the Robot.
    """

    name: str
    stage: str
    reason: str
    starts: int
    aborts: int
    over_budget: int
    computed: dict[str, int]
    stages: tuple[StageSummary, ...]


@dataclass(frozen=True)
class LayerSummary:
    """The layer as a whole.

    Attributes:
        process: Its process.
        alive: Whether that still runs.
        rate: Cycles per second [Hz].
        scheduling: Measures that the kernel granted.
        emergency_stop: Why the emergency stop is tripped; empty while it is not.
        cycles, skipped, overruns, unforgiven: Counts since the start, see `statistics_memory.LoopCount`.
        loop: Stages of the loop.
        plugins: The plugins.
    """

    process: int
    alive: bool
    rate: float
    scheduling: str
    emergency_stop: str
    cycles: int
    skipped: int
    overruns: int
    unforgiven: int
    loop: tuple[StageSummary, ...]
    plugins: tuple[PluginSummary, ...]


class StatisticsReader:
    """Reads the statistics of the layer in a namespace, which may come, end and come back. Costs the layer nothing.

    Args:
        folder: The namespace's folder.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._process = 0
        self._earlier: np.ndarray | None = None

    def look(self) -> LayerSummary | None:
        """Read the present statistics; None if no layer was started, or it has ended in good order."""
        try:
            statistics = RuntimeStatistics.attach(self._folder)
            stop = EmergencyStopLatch(self._folder).reason
        except MiddlewareError:
            return None
        now = statistics.histograms.snapshot()
        if statistics.pid != self._process or self._earlier is None or self._earlier.shape != now.shape:
            self._process = statistics.pid
            self._earlier = np.zeros_like(now)
        recent = Histograms(now).since(self._earlier)
        self._earlier = now
        cycles, skipped, overruns, unforgiven = (statistics.counts[word] for word in LOOP_COUNTS)
        loop = tuple(_stage(statistics, recent, row, name=name) for row, name in enumerate(LOOP_HISTOGRAMS))
        plugins = tuple(_plugin(statistics, recent, index) for index in range(len(statistics.plugins)))
        return LayerSummary(
            statistics.pid,
            statistics.alive,
            statistics.rate,
            scheduling=statistics.text(),
            emergency_stop=stop,
            cycles=cycles,
            skipped=skipped,
            overruns=overruns,
            unforgiven=unforgiven,
            loop=loop,
            plugins=plugins,
        )


def _plugin(statistics: RuntimeStatistics, recent: Histograms, index: int) -> PluginSummary:
    stages = tuple(
        _stage(statistics, recent, statistics.row(index, place), name=name)
        for place, name in enumerate(statistics.stages)
    )
    return PluginSummary(
        statistics.plugins[index],
        statistics.state(index).name,
        statistics.text(index),
        starts=statistics.life(index, PluginCount.STARTS),
        aborts=statistics.life(index, PluginCount.ABORTS),
        over_budget=statistics.life(index, PluginCount.OVER_BUDGET),
        computed=statistics.computed(index),
        stages=stages,
    )


def _stage(statistics: RuntimeStatistics, recent: Histograms, row: int, name: str) -> StageSummary:
    return StageSummary(
        name,
        statistics.histograms.count(row),
        1e-9 * recent.quantile(row, 0.5),
        p99=1e-9 * recent.quantile(row, 0.99),
        longest=1e-9 * statistics.histograms.longest(row),
        skipped=statistics.skips[row],
    )
