"""The tables of `solfer rt`."""

from collections.abc import Iterable, Iterator, Sequence

from solfer.cli.columns import aligned
from solfer.telemetry.statistics import COMPUTED
from solfer.telemetry.summaries import LayerSummary, PluginSummary, StageSummary

COLUMN_WIDTH = 8


def overview(layer: LayerSummary, since: str) -> Iterator[str]:
    """List the whole layer, its plugins' states, and times; p50 and p99 are of the time `since`."""
    yield from heading(layer)
    yield ""
    yield from lives(layer.plugins)
    yield ""
    yield from computed(layer.plugins)
    yield ""
    yield from aligned(times(layer))
    yield ""
    yield "overhead: a cycle without its components; lateness: from the deadline to the beginning of a cycle"
    yield f"p50 and p99 are of {since}, max is since the start; left out: periods, by what took longest then"


def heading(layer: LayerSummary) -> Iterator[str]:
    """List the values of the whole layer."""
    life = "" if layer.alive else " has ended unexpectedly"
    yield f"RT layer: process {layer.process}{life}, {layer.rate:g} Hz, a period of {1e6 / layer.rate:g} us"
    yield f"since the start: cycles {layer.cycles}, periods left out {layer.skipped}, cycles too long {layer.overruns}"
    yield f"scheduling: {layer.scheduling or 'not asked for'}"
    yield f"emergency stop: {layer.emergency_stop or 'no'}"


def lives(plugins: Iterable[PluginSummary]) -> Iterator[str]:
    """List each plugin's state, how often it was started, aborted and over its budget, and why."""
    rows = [
        (plugin.name, plugin.stage, str(plugin.starts), str(plugin.aborts), str(plugin.over_budget), plugin.reason)
        for plugin in plugins
    ]
    return aligned([("plugin", "stage", "starts", "aborts", "over budget", "why"), *rows])


def computed(plugins: Sequence[PluginSummary]) -> Iterator[str]:
    """List how often each quantity of each plugin's Robot was computed; plugins that share a Robot have the same."""
    names = [name for name in COMPUTED if any(plugin.computed[name] for plugin in plugins)]
    rows = [(plugin.name, *(str(plugin.computed[name]) for name in names)) for plugin in plugins]
    return aligned([("computed", *(name.replace("_", " ") for name in names)), *rows])


def times(layer: LayerSummary) -> Iterator[tuple[str, ...]]:
    """List times of the loop, and of the plugins and their stages [us], and the periods left out for each."""
    yield "times [us]", "", *(title.rjust(COLUMN_WIDTH) for title in ("p50", "p99", "max", "left out"))
    for name, stages in (("loop", layer.loop), *((plugin.name, plugin.stages) for plugin in layer.plugins)):
        for stage in stages:
            yield name, stage.name, *_figures(stage)
            name = ""


def _figures(stage: StageSummary) -> Iterator[str]:
    for time in (stage.median, stage.p99, stage.longest):
        yield (f"{1e6 * time:.1f}" if stage.count else "-").rjust(COLUMN_WIDTH)
    yield str(stage.skipped).rjust(COLUMN_WIDTH)
