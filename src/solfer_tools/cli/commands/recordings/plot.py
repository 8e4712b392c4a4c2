"""Draw a recording: a page for each plugin with what it measured, desired and missed, limits, ages and times.

With -c chosen columns over time, one plot for each channel. COLUMN is the name of a channel, such as
arm/command/direct/position, of a column, such as elbow, or both, channel/column; * and ? stand for anything.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from solfer.cli.options import add_column

if TYPE_CHECKING:
    from solfer.recording.model import Recording
    from solfer_tools.review import Figure


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("file", metavar="FILE", type=Path, help="the recording")
    parser.add_argument(
        "-c", dest="columns", metavar="COLUMN", action="append", default=[], help="what to draw; repeat it for several"
    )
    parser.add_argument(
        "-o", dest="output", metavar="OUT", type=Path, help="write .png or .pdf (default: open a window)"
    )
    add_column(parser)


def run(options: argparse.Namespace) -> int:
    """Draw, and print the names of the files.

    Raises:
        RecordingError: The recording cannot be read, has nothing to draw, or the pictures cannot be written.
        UnknownName: There is no such column.
    """
    from solfer.recording.reader import read
    from solfer.recording.selection import chooses
    from solfer_tools.cli.recordings.progress import progress
    from solfer_tools.review import check_suffix, saved, show

    if options.output is not None:
        check_suffix(options.output)
    figures = _figures(read(options.file, chooses(options.columns)), options)
    if options.output is None:
        show(figures)
        return 0
    for path in dict.fromkeys(progress(saved(figures, options.output), len(figures), "pages")):
        print(path)
    return 0


def _figures(recording: "Recording", options: argparse.Namespace) -> "list[tuple[str, Figure]]":
    from solfer.errors import RecordingError
    from solfer.recording.selection import select
    from solfer_tools.cli.recordings.actions import limits_of
    from solfer_tools.review import columns_page, plugin_page

    if not recording.filled:
        raise RecordingError("there are no rows", where=str(options.file), expected="a recording of a plugin that ran")
    if options.columns:
        return [("columns", columns_page(select(recording, options.columns, str(options.file)), options.column))]
    return [
        (plugin, plugin_page(recording, plugin, limits_of(recording, plugin), column=options.column))
        for plugin in recording.plugins
    ]
