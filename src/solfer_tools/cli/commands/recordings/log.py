"""Look into a recording, cut a part out of it, or export it: as CSV, NumPy arrays or a ROS 1 bag.

COLUMN is the name of a channel, such as arm/command/direct/position, of a column, such as elbow, or both,
channel/column; * and ? stand for anything. Times are seconds after the beginning of the recording.
"""

import argparse
from pathlib import Path

from solfer.cli.options import Number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    info = actions.add_parser("info", help="channels, rates, duration, lost rows, attachments, size")
    cut = actions.add_parser("cut", help="write chosen times and columns to another recording")
    export = actions.add_parser("export", help="write a recording for other programs")
    for action in (info, cut, export):
        action.add_argument("file", metavar="FILE", type=Path, help="the recording")
        action.set_defaults(parser=action)
    cut.add_argument("-o", dest="output", metavar="OUT.mcap", type=Path, required=True, help="the new recording")
    forms = export.add_mutually_exclusive_group(required=True)
    forms.add_argument("--csv", metavar="FOLDER", type=Path, help="a CSV file for each channel")
    forms.add_argument("--npz", metavar="OUT.npz", type=Path, help="arrays for NumPy's `load`")
    forms.add_argument("--bag", metavar="OUT.bag", type=Path, help="a ROS 1 bag for `rosbag play`")
    seconds = Number(0.0, 1e9, "seconds")
    for action in (cut, export):
        action.add_argument("--from", dest="begin", type=seconds, metavar="SECONDS", help="leave out what is earlier")
        action.add_argument("--to", dest="end", type=seconds, metavar="SECONDS", help="leave out what is later")
        action.add_argument(
            "-c", dest="columns", metavar="COLUMN", action="append", default=[], help="only this; repeat it for several"
        )


def run(options: argparse.Namespace) -> int:
    """Run the chosen action.

    Raises:
        RecordingError: The recording cannot be read, or the other file not be written.
        UnknownName: There is no such column.
    """
    from solfer_tools.cli.recordings.actions import ACTIONS

    ACTIONS[options.action](options)
    return 0
