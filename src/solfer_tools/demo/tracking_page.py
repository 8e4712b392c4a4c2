"""A page of measured places beside the desired ones."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from solfer_tools.demo.driving_report import Tracked
from solfer_tools.review import DESIRED_COLOR, FIRST_COLOR, FONT_SIZE, draw, dress, new_figure

if TYPE_CHECKING:
    from solfer_tools.review import Figure


def tracking_page(times: np.ndarray, places: Mapping[str, Tracked]) -> "Figure":
    """Draw a plot of each quantity, and one of its distances from the desired places.

    Args:
        times: Shape (k,) [s].
        places: Quantities by their titles.
    """
    figure = new_figure(12.0, 0.5 + 2.4 * len(places))
    grid = np.atleast_2d(figure.subplots(len(places), 2, sharex=True))
    after = times - times[0]
    for (left, right), (title, each) in zip(grid, places.items(), strict=True):
        dress(left, title, label="m")
        for number, name in enumerate(each.names):
            labels = ("desired", "measured") if number == 0 else (None, None)
            draw(left, after, each.desired[:, number], color=DESIRED_COLOR, linewidth=3.0, label=labels[0])
            draw(left, after, each.measured[:, number], color=FIRST_COLOR, linewidth=1.0, label=labels[1])
            left.annotate(name, (after[-1], each.measured[-1, number]), fontsize=FONT_SIZE - 2)
        left.legend(fontsize=FONT_SIZE - 1, loc="upper left")
        dress(right, "distance from the desired place", label="mm")
        for distances in each.distances.T:
            draw(right, after, 1e3 * distances, linewidth=1.0)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=FONT_SIZE)
    return figure
