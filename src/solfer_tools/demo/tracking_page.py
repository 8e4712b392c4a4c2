"""A page of measured places beside the desired ones."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from solfer_tools.demo.driving_report import Tracked
from solfer_tools.review import COLORS, FONT_SIZE, draw, dress, legend, new_figure, time_plots

if TYPE_CHECKING:
    from solfer_tools.review import Figure


def tracking_page(times: np.ndarray, places: Mapping[str, Tracked]) -> "Figure":
    """Draw a plot of each quantity, and one of its distances from the desired places.

    Args:
        times: Shape (k,) [s].
        places: Quantities by their titles.
    """
    figure = new_figure(12.0, 0.5 + 2.4 * len(places))
    grid = iter(time_plots(figure, 2 * len(places), 2))
    after = times - times[0]
    for left, right, (title, each) in zip(grid, grid, places.items(), strict=True):
        dress(left, f"{title}: measured, and desired (broad)", label="m")
        for number, name in enumerate(each.names):
            color = COLORS[number // each.width]  # of the place, as on the right
            dashes = ("-", "--", ":")[number % each.width]
            draw(left, after, each.desired[:, number], color=color, linewidth=3.5, alpha=0.3)
            draw(left, after, each.measured[:, number], color=color, linewidth=1.0, ls=dashes, label=name)
        legend(left)
        dress(right, "distance from the desired place", label="mm")
        for number, distances in enumerate(each.distances.T):
            name = each.names[number * each.width].partition(".")[0] if len(each.distances.T) > 1 else "in the plane"
            draw(right, after, 1e3 * distances, linewidth=1.0, label=name)
        legend(right)
    figure.supxlabel("time [s]", fontsize=FONT_SIZE)
    return figure
