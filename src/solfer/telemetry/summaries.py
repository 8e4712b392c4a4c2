"""Summaries of an RT layer's statistics, read repeatedly from outside, and the health that follows from them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.telemetry.histograms import quantile, since
from solfer.telemetry.statistics import EXECUTOR, LOOP_HISTOGRAMS, LoopCount, PluginCount, RuntimeStatistics
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer.transport.plugin_state import FAILED_STATES


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
        cycles, skipped, overruns, unforgiven: Counts since the start, see `statistics.LoopCount`.
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
        stopped: Returns why the emergency stop of a namespace's folder is tripped; empty while it is not.
    """

    def __init__(self, folder: Path, stopped: Callable[[Path], str]):
        self._folder = folder
        self._stopped = stopped
        self._process = 0
        self._earlier: np.ndarray | None = None

    def look(self) -> LayerSummary | None:
        """Read the present statistics; None if no layer was started, or it has ended in good order."""
        try:
            statistics = RuntimeStatistics.attach(self._folder)
            stop = self._stopped(self._folder)
        except MiddlewareError:
            return None
        now = statistics.histograms.copy()
        if statistics.pid != self._process or self._earlier is None or self._earlier.shape != now.shape:
            self._process = statistics.pid
            self._earlier = np.zeros_like(now)
        recent = since(now, self._earlier)
        self._earlier = now
        counts = statistics.counts

        def stages(names: Iterable[str], first: int) -> tuple[StageSummary, ...]:
            return tuple(
                StageSummary(
                    name,
                    int(now[row, 0]),
                    1e-9 * quantile(recent[row], 0.5),
                    p99=1e-9 * quantile(recent[row], 0.99),
                    longest=1e-9 * int(now[row, 1]),
                    skipped=statistics.skips[row],
                )
                for row, name in enumerate(names, first)
            )

        def plugin(index: int, name: str) -> PluginSummary:
            life = statistics.life(index)
            return PluginSummary(
                name,
                statistics.state(index).name,
                statistics.text(index),
                starts=life[PluginCount.STARTS],
                aborts=life[PluginCount.ABORTS],
                over_budget=life[PluginCount.OVER_BUDGET],
                computed=statistics.computed(index),
                stages=stages(statistics.stages, statistics.row(index, 0)),
            )

        return LayerSummary(
            statistics.pid,
            statistics.alive,
            statistics.rate,
            scheduling=statistics.text(),
            emergency_stop=stop,
            cycles=counts[LoopCount.CYCLES],
            skipped=counts[LoopCount.SKIPPED],
            overruns=counts[LoopCount.OVERRUNS],
            unforgiven=counts[LoopCount.UNFORGIVEN],
            loop=stages(LOOP_HISTOGRAMS, 0),
            plugins=tuple(plugin(index, name) for index, name in enumerate(statistics.plugins)),
        )


def reports_of(now: LayerSummary | None, before: LayerSummary | None) -> dict[str, HealthReport]:
    """Evaluate the health of a layer and of each of its plugins; None: there is no layer."""
    if now is None:
        return {EXECUTOR: HealthReport(Health.ERROR, "there is no real-time layer", {})}
    return {EXECUTOR: layer_report(now, before), **{plugin.name: plugin_report(plugin) for plugin in now.plugins}}


def layer_report(now: LayerSummary, before: LayerSummary | None) -> HealthReport:
    """Evaluate the health of the layer from two summaries.

    A process that has ended or does not cycle, or an emergency stop, is an error; skipped periods, and cycles that were
    too long, since the summary `before` are a warning.
    """
    same = before is not None and before.process == now.process
    values = {
        "process": now.process,
        "rate [Hz]": now.rate,
        "scheduling": now.scheduling or "not asked for",
        "emergency stop": now.emergency_stop or "no",
        "cycles": now.cycles,
        "skipped periods": now.skipped,
        "overruns": now.overruns,
        "overruns not forgiven": now.unforgiven,
        **_times(now.loop),
    }
    if not now.alive:
        return HealthReport(Health.ERROR, f"process {now.process} has ended unexpectedly", values)
    if same and now.cycles == before.cycles:
        return HealthReport(Health.ERROR, f"process {now.process} does not cycle", values)
    if now.emergency_stop:
        return HealthReport(Health.ERROR, f"emergency stop: {now.emergency_stop}", values)
    skipped = now.skipped - (before.skipped if same else 0)
    overruns = now.overruns - (before.overruns if same else 0)
    if skipped or overruns:
        return HealthReport(Health.WARNING, f"periods left out: {skipped}, cycles too long: {overruns}", values)
    return HealthReport(Health.GOOD, f"runs at {now.rate:g} Hz", values)


def plugin_report(plugin: PluginSummary) -> HealthReport:
    """Evaluate the health of a plugin: an error if it failed, a warning if it waits for something."""
    has_failed = plugin.stage in {state.name for state in FAILED_STATES}
    level = Health.ERROR if has_failed else Health.WARNING if plugin.reason else Health.GOOD
    values = {
        "stage": plugin.stage,
        "starts": plugin.starts,
        "aborts": plugin.aborts,
        "over budget": plugin.over_budget,
        **{f"computed {name}": count for name, count in plugin.computed.items() if count},
        **_times(plugin.stages),
    }
    return HealthReport(level, f"{plugin.stage}: {plugin.reason}" if plugin.reason else plugin.stage, values)


def _times(stages: Iterable[StageSummary]) -> dict[str, float | str]:
    values: dict[str, float | str] = {}
    for stage in stages:
        values |= {
            f"{stage.name} median [us]": 1e6 * stage.median,
            f"{stage.name} p99 [us]": 1e6 * stage.p99,
            f"{stage.name} max [us]": 1e6 * stage.longest,
            f"{stage.name} skipped periods": stage.skipped,
        }
    return values
