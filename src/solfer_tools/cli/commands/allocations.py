"""Name the lines that allocate memory in a cycle of the plugins of -n.

They run for some hundred cycles in the mode idle: on the simulated robot, or in the cycles of a recording. The exit
code is 1 if their components allocate.
"""

import argparse
from pathlib import Path

from solfer.cli.options import add_file, add_robot_files, add_search_paths, add_system


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    add_file(parser)
    parser.add_argument(
        "-n", dest="names", metavar="NAME", action="append", help="plugin configuration; repeat it for each one"
    )
    parser.add_argument("--recording", type=Path, metavar="FILE", help="what the plugin receives (default: simulation)")
    add_search_paths(parser)
    add_system(parser)
    add_robot_files(parser)


def run(options: argparse.Namespace) -> int:
    """Measure, and print a table for each plugin.

    Raises:
        SolferError: A plugin cannot be measured.
        SolferErrors: The configuration is wrong.
    """
    from solfer.cli.robots import given_robot
    from solfer.errors import raise_all
    from solfer.plugins.generation.check import check_file
    from solfer_tools.cli.allocations.report import allocations

    places = {"search_paths": options.search_paths, "system": options.system}
    report = check_file(options.file, options.names, robot=given_robot(options), **places)
    raise_all(report.errors)
    return 1 if allocations(options, report) else 0
