"""The lines that allocate, as a table."""

import argparse
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from solfer.cli.columns import aligned
from solfer.cli.robots import given_robot
from solfer.config import CheckReport, Configuration
from solfer.errors import ConfigError
from solfer.plugins.generation.unbuilt import importable_beside
from solfer_tools.cli.allocations.cycles import CycleMeter, on_recording, on_simulation
from solfer_tools.cli.allocations.meter import KEPT_BYTES, OFTEN, LineCost
from solfer_tools.cli.allocations.ownership import SOLFER


def allocations(options: argparse.Namespace, report: CheckReport) -> bool:
    """Measure the plugins of -n and print which lines allocate; returns whether their components are the reason.

    Raises:
        SolferError: One of them cannot be measured.
    """
    found = False
    for configuration in _chosen(options, report):
        with importable_beside(options.file):
            meter = (
                on_simulation(configuration, given_robot(options))
                if options.recording is None
                else on_recording(options.recording, configuration.name, Path(options.file), system=options.system)
            )
        costs = [cost for cost in meter.lines if cost.times or _keeps(cost, meter)]
        what = f"{options.recording}" if options.recording else "the simulated robot"
        print(f"{configuration.name}: {meter.traced} cycles on {what}, after {meter.warm + meter.kept} others")
        head = ("line", "function", "times", "bytes", "kept", "because of")
        for line in aligned([head, *_table(costs, meter)], "  ") if costs else ("no line allocates",):
            print(line)
        found = found or any(
            cost.blamed and (cost.times >= OFTEN * meter.traced or _keeps(cost, meter)) for cost in costs
        )
    return found


def _chosen(options: argparse.Namespace, report: CheckReport) -> Iterator[Configuration]:
    """Yield the configurations to measure.

    Raises:
        ConfigError: None is named, or one is a shared plugin.
    """
    if not options.names:
        raise ConfigError("the cycle of which plugin?", where=str(options.file), expected="-n NAME")
    for name in options.names:
        if report.configurations.get(name) is None:
            raise ConfigError(
                f"'{name}' is no single plugin", where=str(options.file), expected="-n of one that it lists"
            )
        yield report.configurations[name]


def _keeps(cost: LineCost, meter: CycleMeter) -> bool:
    return cost.kept >= KEPT_BYTES * meter.kept


def _table(costs: Sequence[LineCost], meter: CycleMeter) -> Iterator[tuple[str, ...]]:
    """Yield a row for each line, the component's first, those that take most first."""
    for cost in sorted(costs, key=lambda cost: (not cost.blamed, -cost.size - cost.kept)):
        yield (
            f"{_short(cost.file)}:{cost.line}",
            cost.function or "-",
            f"{cost.times / meter.traced:.3g}",
            f"{cost.size / meter.traced:.4g}",
            f"{cost.kept / meter.kept:.3g}" if _keeps(cost, meter) else "-",
            _caller(cost),
        )


def _caller(cost: LineCost) -> str:
    file, _, line = cost.caller.rpartition(":")
    return f"{_short(file)}:{line}" if file else "-"


def _short(file: str) -> str:
    """Return a file as a reader knows it: below solfer, or from the present folder."""
    path = Path(file).resolve()
    if path.is_relative_to(SOLFER.resolve()):
        return str(path.relative_to(SOLFER.resolve().parent))
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative
