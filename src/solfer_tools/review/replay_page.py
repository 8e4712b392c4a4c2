"""The picture of a replay: the numbers that it sends otherwise, the first one on top."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from solfer_tools.review.canvas import (
    COLUMN_WIDTH,
    FIRST_COLOR,
    FONT_SIZE,
    SECOND_COLOR,
    WRONG_COLOR,
    draw,
    dress,
    legend,
    new_figure,
    time_plots,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_REPLAY_ROWS = 8
"""Most numbers on a page."""


def replay_page(
    title: str, times: np.ndarray, tracks: Sequence[tuple[str, np.ndarray, np.ndarray]], column: bool = False
) -> "Figure":
    """Draw numbers as recorded and as replayed, and their differences.

    Args:
        title: Title of the page.
        times: Of the cycles, shape (T,) [s].
        tracks: Title, recorded and replayed values of each number, shape (T,); after `MAX_REPLAY_ROWS` they are left
            out.
        column: Whether the page is for a paper's column.
    """
    shown = tracks[:MAX_REPLAY_ROWS]
    figure = new_figure(COLUMN_WIDTH if column else 12.0, 0.8 + (3.0 if column else 1.9) * max(1, len(shown)))
    grid = iter(time_plots(figure, 2 * len(shown), 1 if column else 2))
    for left, right, (name, recorded, replayed) in zip(grid, grid, shown, strict=True):
        draw(left, times, recorded, color=FIRST_COLOR, lw=1.6, label="recorded")
        draw(left, times, replayed, color=SECOND_COLOR, lw=1.0, label="replayed")
        draw(right, times, replayed - recorded, color=WRONG_COLOR, lw=1.0)
        legend(left)
        dress(left, name)
        dress(right, "difference")
    figure.supxlabel("time after the first cycle [s]", fontsize=FONT_SIZE)
    figure.suptitle(title, fontsize=FONT_SIZE + (0 if column else 3))
    return figure
