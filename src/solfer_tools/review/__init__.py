"""Reviews of recordings: what differs between two of them, and pictures (docs/reference/logs.md).

Everything is imported from here; a recorder and a plugin import nothing of it. Only pictures need matplotlib, which is
imported when something is drawn.
"""

from typing import TYPE_CHECKING

from solfer_tools.review.canvas import (
    COLORS,
    DESIRED_COLOR,
    FIRST_COLOR,
    FONT_SIZE,
    SECOND_COLOR,
    WRONG_COLOR,
    check_suffix,
    draw,
    dress,
    legend,
    new_figure,
    outline,
    save,
    saved,
    show,
    time_plots,
)
from solfer_tools.review.columns_page import columns_page
from solfer_tools.review.compare import Comparison, compare
from solfer_tools.review.comparison_page import comparison_page
from solfer_tools.review.plugin_page import plugin_page
from solfer_tools.review.replay_page import MAX_REPLAY_ROWS, replay_page
from solfer_tools.review.tracks import tracks_of
from solfer_tools.review.verdict import Difference, JointVerdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "COLORS",
    "FONT_SIZE",
    "DESIRED_COLOR",
    "FIRST_COLOR",
    "MAX_REPLAY_ROWS",
    "SECOND_COLOR",
    "WRONG_COLOR",
    "Comparison",
    "Difference",
    "Figure",
    "JointVerdict",
    "check_suffix",
    "columns_page",
    "compare",
    "comparison_page",
    "draw",
    "dress",
    "legend",
    "new_figure",
    "outline",
    "plugin_page",
    "replay_page",
    "save",
    "saved",
    "show",
    "time_plots",
    "tracks_of",
]
