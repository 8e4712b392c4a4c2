"""`solfer view` as a process: the commands of docs/how-to/view.md, with a page without a browser."""

import re
import time

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page, view  # noqa: E402

TIME = 120.0
"""Longest time from the command of the page of the docs to a changed gain [s]."""


@pytest.mark.slow
def test_a_study_drives_and_is_tuned_on_the_page(repository):
    """The command of the documentation shows a moving robot, and a parameter that one page sets changes on another."""
    begin = time.monotonic()
    (line,) = re.findall(
        r"^solfer view (--run \S+ --control)$", (repository / "docs/how-to/view.md").read_text(), re.MULTILINE
    )
    with view(*line.split()) as address, opened_page(address) as page:
        end = time.monotonic() + 60.0
        places = []
        while time.monotonic() < end and (len(places) < 2 or np.linalg.norm(places[-1] - places[0]) < 0.01):
            page.receive(0.3)
            if "/measured/pelvis" in page.positions:
                places.append(np.array(page.positions["/measured/pelvis"]))
        assert np.linalg.norm(places[-1] - places[0]) >= 0.01, "it does not move"
        assert "wheeled_motion" in page.tabs and "running" in page.content
        page.click("take control")
        page.until(lambda: "you have control" in page.content, "control")
        with opened_page(address) as other:
            label = "steerings.reactif.tracking [1/s]"
            page.until(lambda: label in page.labels, "parameters")
            other.until(lambda: label in other.labels, "parameters")
            gain = 0.5 * other.gui[other.find(label)]["value"]
            page.change(label, gain)
            other.until(lambda: page.receive() or other.gui[other.find(label)]["value"] == gain, "a changed gain")
        assert time.monotonic() - begin < TIME


GREEN = (60, 190, 70)


def share(picture, color):
    """Share of the pixels that have a colour, about."""
    image = pytest.importorskip("PIL.Image")
    pixels = np.asarray(image.open(picture).convert("RGB"), dtype=float)
    return float((np.abs(pixels - color).max(axis=2) < 40.0).mean())


def test_the_page_of_the_docs_has_the_picture(repository):
    assert "](../pictures/view.png)" in (repository / "docs/how-to/view.md").read_text()
    assert share(repository / "docs/pictures/view.png", GREEN) > 1e-4
