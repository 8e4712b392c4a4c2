"""Check a main configuration, or the file of an RT layer: all mistakes and warnings at once, with their places.

The exit code is 0 if the configuration can be used, also with warnings, and 2 if not. Names of joints, links, groups
and maps are checked with the shipped robot that `robot.name` names, or with the robot of --urdf and --srdf. Each plugin
is made as at its start, component included, but connects to nothing. A package that is not built yet is looked for
beside FILE. Where nothing is wrong, the robot is simulated for a second. Of an RT layer, such as config/xbot.yaml, the
plugins that it lists are checked as they run in the layer.
"""

import argparse
import sys
from typing import TYPE_CHECKING

from solfer.cli.options import add_file, add_robot_files, add_search_paths, add_system

if TYPE_CHECKING:
    from pathlib import Path

    from solfer.config import CheckReport
    from solfer.config.yaml.nodes import Mark


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    add_file(parser)
    parser.add_argument(
        "-n",
        dest="names",
        metavar="NAME",
        action="append",
        help="plugin configuration to check; repeat it for each one (default: the whole file)",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print a list of objects with severity (error, warning or info), file, line, column, path, "
        "message, expected and names (the nearest ones that there are)",
    )
    add_search_paths(parser)
    add_system(parser)
    add_robot_files(parser)


def run(options: argparse.Namespace) -> int:
    """Check and print the findings: mistakes and warnings to stderr, a summary to stdout; or all as JSON."""
    from solfer.cli.findings import findings_of, summary
    from solfer.cli.robots import given_robot
    from solfer.config.loading.rt_layer import is_layer, read_once
    from solfer.plugins.generation.check import check_file, check_layer
    from solfer.throttle import logged_once

    file = read_once(options.file)
    with logged_once():
        report = (check_layer if is_layer(file) else check_file)(
            file,
            options.names,
            search_paths=options.search_paths,
            system=options.system,
            robot=given_robot(options),
        )
        if not report.errors:
            _simulate_robots(report)
    findings = findings_of(report)
    if options.json:
        import json

        print(json.dumps([finding.as_dict() for finding in findings], indent=2, ensure_ascii=False))
    else:
        for finding in findings:
            print(f"{finding.severity}: {finding.text}", file=sys.stderr)
        sys.stderr.flush()
        print(summary(options.file, report))
    return 2 if report.errors else 0


def _simulate_robots(report: "CheckReport") -> None:
    """Add what is wrong with the simulation of the robots that a file names."""
    from solfer.errors import SolferError
    from solfer.robot.description.shipped import bundle_of

    robots: dict[Path, Mark] = {}
    for configuration in report.configurations.values():
        bundle = bundle_of(configuration) if configuration.system == "SM" else None
        if bundle is not None and bundle.suffix == ".yaml":
            robots.setdefault(bundle, configuration.tree.nearest(("robot", "name")).head)
    from solfer.simulation.engines import is_installed

    if not robots or not is_installed():
        return
    from solfer.simulation.trial import simulate_for_a_second

    for bundle, mark in robots.items():
        try:
            wrong = simulate_for_a_second(bundle)
        except SolferError as error:
            report.problems.put(mark, error)
        else:
            if wrong:
                report.problems.warn(mark, f"{bundle}: {wrong}")
