"""Live tables of `solfer top`."""

import argparse
import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Mapping

from solfer.cli.columns import aligned
from solfer.cli.rt.tables import overview
from solfer.middleware.shared_memory.health_reports import Reports
from solfer.realtime.emergency_stop import stopped
from solfer.segments.namespace import Namespace
from solfer.telemetry.statistics import RuntimeStatistics
from solfer.telemetry.summaries import LayerSummary, StatisticsReader, reports_of
from solfer.transport.middleware import HealthReport


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
            yield "the RT layer has ended"
        else:
            yield from health({**reports_of(layer, before), **others.read()})
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
        silent = {name for name, (_, newest) in seen.items() if now - newest > max(5.0, 2.0 * options.every)}
        yield from health({name: report for name, (report, _) in seen.items()}, silent)

    with watched() as reports:
        reports()
        time.sleep(2.5)  # in which each node reports each of its parts
        _print(options, lines)


def health(reports: Mapping[str, HealthReport], silent: set[str] | frozenset[str] = frozenset()) -> Iterator[str]:
    """List the health of each part, and why; those that are `silent` do not report any more."""
    rows = [
        (name, "SILENT" if name in silent else report.level.name, report.summary.replace("\n", " "))
        for name, report in sorted(reports.items())
    ]
    return aligned([("part", "health", "why"), *rows])


def _print(options: argparse.Namespace, lines: Callable[[], Iterator[str]]) -> None:
    clear = "\x1b[H\x1b[2J" if sys.stdout.isatty() and not options.once else ""
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            print(clear + "\n".join(lines()), flush=True)
            if options.once:
                return
            time.sleep(options.every)
