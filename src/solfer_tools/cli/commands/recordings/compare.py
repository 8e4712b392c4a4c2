"""Compare two recordings of the same motion: which joint differs first, and how.

A counts as right, such as a simulation; B is checked, such as the hardware. The clocks need not agree: the motion
aligns them. Differences are a wrong sign, swapped joints, a gain, an offset, a delay, a joint that is missing or stands
still. The exit code is 0 if no joint differs, 1 if one does, and 2 after an error.
"""

import argparse
from pathlib import Path

from solfer.cli.options import add_column


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("first", metavar="A", type=Path, help="recording that counts as right")
    parser.add_argument("second", metavar="B", type=Path, help="recording that is checked")
    parser.add_argument(
        "-n",
        dest="names",
        metavar="NAME",
        action="append",
        default=[],
        help="plugin whose feedbacks count; repeat it for several (default: all)",
    )
    parser.add_argument("--limits", action="store_true", help="print what would have been found of each joint, too")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the joints that differ: .png or .pdf")
    add_column(parser)


def run(options: argparse.Namespace) -> int:
    """Compare, print and draw.

    Raises:
        RecordingError: A recording cannot be read, or they cannot be compared.
    """
    from solfer.recording.reader import read
    from solfer_tools.cli.recordings.comparison import report
    from solfer_tools.review import check_suffix, compare, comparison_page, save

    names = (str(options.first), str(options.second))
    if options.plot is not None:
        check_suffix(options.plot)
    result = compare(read(options.first), read(options.second), names, plugins=options.names)
    for line in report(result, names, options.limits):
        print(line)
    if options.plot is not None:
        short = (options.first.stem, options.second.stem)
        page = comparison_page(result, short if short[0] != short[1] else names, options.column)
        save([("comparison", page)], options.plot)
    return 1 if result.different else 0
