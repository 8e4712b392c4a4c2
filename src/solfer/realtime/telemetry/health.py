"""Health reports of an RT layer and of its plugins, from their statistics."""

from collections.abc import Iterable

from solfer.realtime.telemetry.statistics_memory import EXECUTOR
from solfer.realtime.telemetry.summaries import LayerSummary, PluginSummary, StageSummary
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer.transport.plugin_state import FAILED_STATES

FAILED_NAMES = frozenset(state.name for state in FAILED_STATES)


def reports_of(now: LayerSummary | None, before: LayerSummary | None) -> dict[str, HealthReport]:
    """Judge the health of a layer and of each of its plugins; None: there is no layer."""
    if now is None:
        return {EXECUTOR: HealthReport(Health.ERROR, "there is no real-time layer", {})}
    return {EXECUTOR: layer_report(now, before), **{plugin.name: plugin_report(plugin) for plugin in now.plugins}}


def layer_report(now: LayerSummary, before: LayerSummary | None) -> HealthReport:
    """Judge the health of the layer from two summaries.

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
        return HealthReport(Health.WARNING, f"{skipped} periods left out, {overruns} cycles too long", values)
    return HealthReport(Health.GOOD, f"runs at {now.rate:g} Hz", values)


def plugin_report(plugin: PluginSummary) -> HealthReport:
    """Judge the health of a plugin: an error if it failed, a warning if it waits for something."""
    level = Health.ERROR if plugin.stage in FAILED_NAMES else Health.WARNING if plugin.reason else Health.GOOD
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
