"""Live tables of `solfer top`."""

import argparse
import contextlib
import json
import math
import os
import re
import shutil
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping

from solfer.cli.columns import aligned
from solfer.cli.rt.tables import overview
from solfer.middleware.shared_memory.health_reports import Reports
from solfer.realtime.emergency_stop import stopped
from solfer.segments.namespace import Namespace
from solfer.telemetry.statistics import RuntimeStatistics
from solfer.telemetry.summaries import LayerSummary, StatisticsReader, reports_of
from solfer.transport.middleware import HealthReport

SILENT = "SILENT"
"""Health of a part that does not report any more."""

COLORS = {"GOOD": "\x1b[32m", "WARNING": "\x1b[33m", "ERROR": "\x1b[31m", SILENT: "\x1b[31m"}
"""Colour of each health on a terminal: green, yellow or red."""


def top_of_layer(options: argparse.Namespace, namespace: Namespace) -> None:
    """Print the tables of an RT layer until Ctrl-C, or once. A layer that has ended may start again."""
    RuntimeStatistics.attach(namespace.folder)
    observer = StatisticsReader(namespace.folder, stopped)
    others = Reports(namespace)
    before: LayerSummary | None = None
    since = "all cycles"

    def lines() -> Iterator[str]:
        nonlocal before, since
        layer = observer.look()
        if layer is None:
            yield as_json({}) if options.json else "the RT layer has ended"
        else:
            reports = {**reports_of(layer, before), **others.read()}
            if options.json:
                yield as_json(reports)
            else:
                yield from health(reports)
                yield ""
                yield from overview(layer, since)
        before = layer
        since = f"the last {options.every:g} s"

    _print(options, lines)


def top_of_nodes(options: argparse.Namespace) -> None:
    """Print the table of all nodes of a ROS master until Ctrl-C, or once."""
    from solfer.middleware.ros.diagnostics import watched

    seen: dict[str, tuple[HealthReport, float]] = {}

    def lines() -> Iterator[str]:
        now = time.monotonic()
        for name, report in dict(reports()).items():
            if name not in seen or seen[name][0] is not report:
                seen[name] = report, now
        silent = {name for name, (_, time_of) in seen.items() if now - time_of > max(5.0, 2.0 * options.every)}
        newest = {name: report for name, (report, _) in seen.items()}
        yield from [as_json(newest, silent)] if options.json else health(newest, silent)

    with watched() as reports:
        _print(options, lines)


def health(reports: Mapping[str, HealthReport], silent: Collection[str] = ()) -> Iterator[str]:
    """List the health of each part, and why; those that are `silent` do not report any more."""
    rows = [
        (name, _level(name, report, silent), report.summary.replace("\n", " "))
        for name, report in sorted(reports.items())
    ]
    return aligned([("part", "health", "why"), *rows])


def as_json(reports: Mapping[str, HealthReport], silent: Collection[str] = ()) -> str:
    """Write the health of each part, why, and its figures, as a line of JSON, which has no NaN; see `health`."""
    parts = {}
    for name, report in sorted(reports.items()):
        values = {
            key: value if isinstance(value, str) or math.isfinite(value) else str(value)
            for key, value in report.values.items()
        }
        parts[name] = {"health": _level(name, report, silent), "why": report.summary, "values": values}
    return json.dumps(parts)


def _level(name: str, report: HealthReport, silent: Collection[str]) -> str:
    return SILENT if name in silent else report.level.name


def _print(options: argparse.Namespace, lines: Callable[[], Iterator[str]]) -> None:
    is_screen = sys.stdout.isatty() and not options.json
    clear = "\x1b[H\x1b[2J" if is_screen and not options.once else ""
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            shown = map(_fitted, lines()) if is_screen else lines()
            print(clear + "\n".join(shown), flush=True)
            if options.once:
                return
            time.sleep(options.every)


def _fitted(line: str) -> str:
    """Cut a line at the width of the terminal, and colour the health in it, unless the environment forbids colours."""
    width = shutil.get_terminal_size().columns
    line = line if len(line) <= width else line[: width - 1] + "\N{HORIZONTAL ELLIPSIS}"
    if os.environ.get("NO_COLOR"):
        return line
    return re.sub(
        rf"(?<=  )({'|'.join(COLORS)})(?=  |$)", lambda found: f"{COLORS[found[1]]}{found[1]}\x1b[0m", line, count=1
    )
