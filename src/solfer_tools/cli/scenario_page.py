"""Picture of a scenario."""

from typing import TYPE_CHECKING

import numpy as np

from solfer_tools.cli.scenario_trace import ScenarioTrace
from solfer_tools.review import (
    DESIRED_COLOR,
    FIRST_COLOR,
    FONT_SIZE,
    SECOND_COLOR,
    draw,
    dress,
    legend,
    new_figure,
)

if TYPE_CHECKING:
    from solfer_tools.review import Figure


def scenario_page(trace: ScenarioTrace) -> "Figure":
    """Draw the paths of base and vertices from above, the base, and the vertices' distances from their begins."""
    figure = new_figure(9.0, 6.0)
    above, base, moved = figure.subplot_mosaic([["above", "base"], ["above", "moved"]]).values()
    cos = np.cos(trace.base[:, 3])
    sin = np.sin(trace.base[:, 3])
    x = trace.base[:, 0]
    y = trace.base[:, 1]
    for leg in range(trace.scenario.legs):
        along = trace.vertices[:, leg, 0]
        across = trace.vertices[:, leg, 1]
        above.plot(x + cos * along - sin * across, y + sin * along + cos * across, color=DESIRED_COLOR, linewidth=0.7)
    above.plot(x, y, color=FIRST_COLOR)
    ends = np.cumsum((0, *trace.scenario.periods))
    above.plot(x[ends], y[ends], "o", color=SECOND_COLOR, markersize=3)
    above.set_aspect("equal", adjustable="datalim")
    dress(above, "base (blue) and vertices from above [m]")
    times = trace.times
    for column, name in enumerate(("x m", "y m", "z m", "heading rad")):
        draw(base, times, trace.base[:, column] - trace.base[0, column], label=name, linewidth=1.0)
    legend(base)
    dress(base, "base, from its begin")
    far = np.linalg.norm(trace.vertices - trace.vertices[0], axis=2)
    for number, distances in enumerate(far.T):
        draw(moved, times, distances, label=f"vertex {number + 1}", linewidth=1.0)
    legend(moved)
    dress(moved, "vertices, from their begins", "m")
    moved.set_xlabel("time [s]", fontsize=FONT_SIZE)
    return figure
