"""The picture of a comparison: the joints that differ, the first one on top."""

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
from solfer_tools.review.compare import Comparison
from solfer_tools.review.verdict import JointVerdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def comparison_page(comparison: Comparison, names: tuple[str, str], column: bool = False) -> "Figure":
    """Draw both positions and their difference, of the joints that differ first; if none does, where most is left.

    Args:
        comparison: What was found out.
        names: Names of the two recordings.
        column: Whether the page is for a paper's column.
    """
    place = {joint: row for row, joint in enumerate(comparison.joints)}
    shown = [verdict for verdict in comparison.different if verdict.joint in place][:8]
    if not shown:
        known = (verdict for verdict in comparison.verdicts if verdict.joint in place)
        shown = sorted(known, key=lambda verdict: -verdict.largest)[:4]
    figure = new_figure(COLUMN_WIDTH if column else 12.0, 0.8 + (3.0 if column else 1.9) * len(shown))
    grid = iter(time_plots(figure, 2 * len(shown), 1 if column else 2))
    for left, right, verdict in zip(grid, grid, shown, strict=True):
        _joint(left, right, verdict, comparison=comparison, row=place[verdict.joint], names=names)
    figure.supxlabel(f"time after the beginning of {names[0]} [s]", fontsize=FONT_SIZE)
    count = len(comparison.different)
    differ = f"{count} joint{'s differ' if count != 1 else ' differs'}" if count else "no joint differs"
    figure.suptitle(f"{names[1]} against {names[0]}: {differ}", fontsize=FONT_SIZE + (0 if column else 3))
    return figure


def _joint(
    left: "Axes", right: "Axes", verdict: JointVerdict, comparison: Comparison, row: int, *, names: tuple[str, str]
) -> None:
    times = comparison.times
    first = comparison.first[row]
    second = comparison.second[row]
    draw(left, times, first, color=FIRST_COLOR, lw=1.2, label=names[0])
    draw(left, times, second, color=SECOND_COLOR, lw=1.2, ls="--", label=names[1])
    draw(right, times, 1e3 * (second - first), color="black", lw=0.9)
    right.axhline(0.0, color="grey", lw=0.5)
    dress(left, verdict.joint, "position [rad, m]")
    since = "" if np.isnan(verdict.since) else f", since {verdict.since:.3f} s"
    dress(right, f"{verdict.text or 'no difference'}{since}", "difference\n[mrad, mm]")
    legend(left)
    if since:
        for axes in (left, right):
            axes.axvline(verdict.since, color=WRONG_COLOR, lw=0.9)
