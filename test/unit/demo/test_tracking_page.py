"""The plots of places of the demonstration."""

import numpy as np
import pytest

from solfer_tools.demo.driving_report import Tracked
from solfer_tools.demo.tracking_page import tracking_page


@pytest.mark.slow
def test_every_line_is_in_a_legend_and_no_label_beside_it():
    """Labels at the ends of lines would lie on each other where the lines end at one height."""
    names = tuple(f"wheel_{leg}.{axis}" for leg in (1, 2) for axis in "xy")
    still = np.zeros((5, 4))
    figure = tracking_page(np.arange(5.0), {"vertices": Tracked(names, still, still, width=2)})
    legends = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in figure.axes]
    assert legends == [list(names), ["wheel_1", "wheel_2"]]
    assert not any(axes.texts for axes in figure.axes) and figure.get_supxlabel() == "time [s]"
