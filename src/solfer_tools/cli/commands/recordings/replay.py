"""Replay what a plugin received, and compare its commands with the recorded ones.

The component works through the recorded cycles, faster than they took, and sends nothing to anybody. An unchanged one
sends the same to 1e-9; of another configuration, or a changed component, the first cycle and joint that differ are
named. The exit code is 0 if all commands are the same, 1 if not, and 2 after an error.
"""

import argparse
from pathlib import Path

from solfer.cli.options import add_column, add_system


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("file", metavar="FILE", type=Path, help="the recording")
    parser.add_argument("-n", dest="name", metavar="NAME", required=True, help="plugin configuration to replay")
    parser.add_argument(
        "-c", dest="configuration", metavar="FILE", type=Path, help="its main configuration (default: the recorded one)"
    )
    parser.add_argument(
        "--plugin",
        metavar="NAME",
        help="recorded plugin whose feedback it gets (default: that of the name, or the only)",
    )
    parser.add_argument("--plot", type=Path, metavar="OUT", help="draw the numbers that differ: .png or .pdf")
    add_column(parser)
    add_system(parser)


def run(options: argparse.Namespace) -> int:
    """Replay, print and draw.

    Raises:
        SolferError: The recording or the configuration cannot be used.
    """
    from solfer_tools.cli.recordings.replay import draw, replayed, report

    if options.plot is not None:
        from solfer_tools.review import check_suffix

        check_suffix(options.plot)
    replay, found = replayed(options)
    for line in report(replay, found):
        print(line)
    if options.plot is not None:
        draw(replay, found, options.plot, column=options.column)
        print(options.plot)
    return 0 if found.same else 1
