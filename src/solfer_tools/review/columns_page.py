"""A page of chosen columns over time."""

from typing import TYPE_CHECKING

from solfer.recording.model import Recording
from solfer.recording.selection import span
from solfer_tools.review.canvas import COLUMN_WIDTH, FONT_SIZE, new_figure, time_plots
from solfer_tools.review.plugin_page import MOST_LINES, lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def columns_page(recording: Recording, column: bool = False) -> "Figure":
    """Draw one plot for each channel.

    Args:
        recording: The columns; see `solfer.recording.selection.select`.
        column: Whether the page is for a paper's column.
    """
    channels = recording.filled
    start, _ = span(recording)
    heights = [1.6 + 0.08 * min(MOST_LINES, len(each.columns)) if column else 2.4 for each in channels]
    figure = new_figure(COLUMN_WIDTH if column else 12.0, 0.5 + sum(heights))
    for axes, channel in zip(time_plots(figure, len(channels), 1), channels, strict=True):
        lines(axes, channel.name, [channel], start=start)
    figure.supxlabel("time [s]", fontsize=FONT_SIZE)
    return figure
