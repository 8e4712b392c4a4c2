"""Print the URDF of the upper or the lower part of a robot.

A launch file gives a part to a Robot with `<param name="..." command="solfer cut URDF --at LINK --keep PART" />`.
"""

import argparse
import sys
from pathlib import Path

from solfer.errors import writing


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("urdf", metavar="URDF", help="file of the whole robot")
    parser.add_argument("--at", required=True, metavar="LINK", help="the link above the cut")
    parser.add_argument(
        "--keep",
        required=True,
        choices=("upper", "lower"),
        help="upper: LINK and what it carries, on a fixed root; lower: the rest",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="write to FILE, not to stdout")


def run(options: argparse.Namespace) -> int:
    """Cut and write.

    Raises:
        SolferError: The robot cannot be read or cut there, or the file cannot be written.
    """
    from solfer.model.urdf.cut import cut
    from solfer.model.urdf.description import Description

    text = cut(Description.from_file(options.urdf), options.at, options.keep)
    if options.output is None:
        sys.stdout.write(text)
        return 0
    with writing("the URDF", options.output):
        options.output.write_text(text, encoding="utf-8")
    return 0
