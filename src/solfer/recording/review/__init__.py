"""Reviews of recordings: what differs between two of them, and pictures (docs/reference/logs.md).

Everything is imported from here; a recorder and a plugin import nothing of it. Only pictures need matplotlib, which is
imported when something is drawn.
"""

from typing import TYPE_CHECKING

from solfer.recording.review.canvas import (
    DESIRED_COLOR,
    FIRST_COLOR,
    FONT_SIZE,
    SECOND_COLOR,
    WRONG_COLOR,
    check_suffix,
    draw,
    dress,
    new_figure,
    outline,
    save,
    saved,
    show,
)
from solfer.recording.review.columns_page import columns_page
from solfer.recording.review.compare import Comparison, compare
from solfer.recording.review.comparison_page import comparison_page
from solfer.recording.review.plugin_page import plugin_page
from solfer.recording.review.replay_page import MAX_REPLAY_ROWS, replay_page
from solfer.recording.review.tracks import tracks_of
from solfer.recording.review.verdict import Difference, JointVerdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
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
    "new_figure",
    "outline",
    "plugin_page",
    "replay_page",
    "save",
    "saved",
    "show",
    "tracks_of",
]
