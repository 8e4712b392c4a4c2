"""What the figures of an RT layer mean: health reports of the layer and of its plugins."""

from collections.abc import Iterable

from solfer.middleware.xbot.figures import LayerFigures, PluginFigures, StageFigures
from solfer.middleware.xbot.lifecycle import Stage
from solfer.pipes.middleware import Report

GOOD, WARNING, ERROR = range(3)
FAILED = frozenset({Stage.ABORTED.name, Stage.FAULT.name})


def layer_report(now: LayerFigures, before: LayerFigures | None) -> Report:
    """Health of the layer, which was looked at a while before as well.

    An error is a process that has ended or does not cycle, or an emergency stop; a warning are periods that were left
    out, and cycles that were too long, since the look before.
    """
    same = before is not None and before.process == now.process
    values = {"process": now.process, "rate [Hz]": now.rate, "scheduling": now.scheduling or "not asked for",
              "emergency stop": now.emergency_stop or "no", "cycles": now.cycles, "skipped periods": now.skipped,
              "overruns": now.overruns, "overruns not forgiven": now.unforgiven, **_times(now.loop)}
    if not now.alive:
        return Report(ERROR, f"process {now.process} has ended without a word", values)
    if same and now.cycles == before.cycles:
        return Report(ERROR, f"process {now.process} does not cycle", values)
    if now.emergency_stop:
        return Report(ERROR, f"emergency stop: {now.emergency_stop}", values)
    skipped = now.skipped - (before.skipped if same else 0)
    overruns = now.overruns - (before.overruns if same else 0)
    if skipped or overruns:
        return Report(WARNING, f"{skipped} periods left out, {overruns} cycles too long", values)
    return Report(GOOD, f"runs at {now.rate:g} Hz", values)


def plugin_report(plugin: PluginFigures) -> Report:
    """Health of a plugin: an error if it failed, a warning if it waits for something."""
    level = ERROR if plugin.stage in FAILED else WARNING if plugin.reason else GOOD
    values = {"stage": plugin.stage, "starts": plugin.starts, "aborts": plugin.aborts,
              "over budget": plugin.over_budget, **_times(plugin.stages)}
    return Report(level, f"{plugin.stage}: {plugin.reason}" if plugin.reason else plugin.stage, values)


def _times(stages: Iterable[StageFigures]) -> dict[str, float | str]:
    values: dict[str, float | str] = {}
    for stage in stages:
        values |= {f"{stage.name} median [us]": 1e6 * stage.median, f"{stage.name} p99 [us]": 1e6 * stage.p99,
                   f"{stage.name} max [us]": 1e6 * stage.longest, f"{stage.name} skipped periods": stage.skipped}
    return values
