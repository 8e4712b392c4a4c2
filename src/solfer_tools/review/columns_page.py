"""A page of chosen columns over time."""

from typing import TYPE_CHECKING

import numpy as np

from solfer.recording.model import Recording
from solfer.recording.selection import span
from solfer_tools.review.canvas import FONT_SIZE, new_figure
from solfer_tools.review.plugin_page import lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def columns_page(recording: Recording) -> "Figure":
    """Draw one plot for each channel.

    Args:
        recording: The columns; see `solfer.recording.selection.select`.
    """
    channels = recording.filled
    start, _ = span(recording)
    figure = new_figure(12.0, 0.5 + 2.4 * max(1, len(channels)))
    grid = np.atleast_1d(figure.subplots(max(1, len(channels)), 1, sharex=True))
    for axes, channel in zip(grid, channels, strict=False):
        lines(axes, channel.name, [channel], start=start)
    grid[-1].set_xlabel("time [s]", fontsize=FONT_SIZE)
    return figure
