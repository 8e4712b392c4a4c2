"""Show a robot and its plugins in the browser: live over ROS or in a real-time layer, simulated in memory, recorded.

It prints the address of the page, which has a random token and is for browsers of this machine alone.
"""

import argparse
from pathlib import Path

from solfer.cli.options import Number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("file", metavar="FILE", nargs="?", type=Path, help="a recording (default: ROS, live)")
    parser.add_argument("--beside", metavar="FILE", type=Path, help="another recording, drawn in blue where it differs")
    parser.add_argument("--robot", metavar="NAME|FILE", help="robot of this package, or its bundle (default: centauro)")
    sources = parser.add_mutually_exclusive_group()
    sources.add_argument("--namespace", metavar="NAME", help="look into the real-time layer of this namespace, no ROS")
    sources.add_argument(
        "--run", dest="study", metavar="STUDY", help="simulate the plugins of a study in memory, with its motion"
    )
    parser.add_argument(
        "--port",
        type=Number(0, 65535, "", int),
        default=8080,
        help="port, or the next free one (default: 8080; 0: any)",
    )
    parser.add_argument(
        "--foxglove", action="store_true", help="a server for Foxglove beside it, at the second address that is printed"
    )
    parser.add_argument(
        "--control", action="store_true", help="let one page at a time command: references, the base, plugins"
    )


def run(options: argparse.Namespace) -> int:
    """Show the page until Ctrl-C.

    Raises:
        SolferError: There is no such robot or source, or viser is missing.
    """
    others = (options.namespace, options.study, options.foxglove or None, options.control or None)
    if options.file is not None and any(each is not None for each in others):
        options.parser.error("a recording with --namespace, --run, --foxglove or --control, expected FILE alone")
    if options.beside is not None and options.file is None:
        options.parser.error("--beside without a recording, expected FILE --beside FILE")
    from solfer_tools.cli.view.actions import show

    return show(options)
