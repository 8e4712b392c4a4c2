"""`solfer view` as a process: the commands of docs/how-to/view.md, without a browser, and in Debian's Chromium."""

import re
import time

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.browser import CHROMIUM, browser  # noqa: E402
from support.page import opened_page, view  # noqa: E402


@pytest.mark.slow
def test_a_study_drives_on_the_page(repository):
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
        page.until(lambda: re.search(r"page \d+ commands", page.content), "control")


@pytest.mark.soak
@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium")
def test_chromium_draws_the_page(tmp_path):
    with view("--run", "config/studies/robustness.yaml") as address:
        with browser(tmp_path / "profile", address) as seen:
            seen.wait("(document.getElementById('solfer-beat')?.dataset.count ?? 0) > 20")
            seen.picture(tmp_path / "view.png")
            assert share(tmp_path / "view.png", GREEN) > 1e-4, "no support polygon"
            seen.click("EMERGENCY STOP")
            seen.click("stop the robot now")
            seen.wait("!document.body.innerText.includes('stop the robot now')")


@pytest.mark.soak
@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium")
def test_chromium_keeps_control_however_slowly_it_draws(tmp_path):
    """Without a graphics card it draws about one picture a second."""
    commands = r"/page \d+ commands/.test(document.body.innerText)"
    with view("--run", "config/studies/robustness.yaml", "--control") as address:
        with browser(tmp_path / "profile", address) as seen:
            seen.wait("(document.getElementById('solfer-beat')?.dataset.count ?? 0) > 20")
            seen.click("take control")
            seen.wait(commands)
            end = time.monotonic() + 10.0
            while time.monotonic() < end:
                assert seen.evaluate(commands)
                time.sleep(0.2)


GREEN = (60, 190, 70)


def share(picture, color):
    """Share of the pixels that have a colour, about."""
    image = pytest.importorskip("PIL.Image")
    pixels = np.asarray(image.open(picture).convert("RGB"), dtype=float)
    return float((np.abs(pixels - color).max(axis=2) < 40.0).mean())


def test_the_page_of_the_docs_has_the_picture(repository):
    assert "](../pictures/view.png)" in (repository / "docs/how-to/view.md").read_text()
    assert share(repository / "docs/pictures/view.png", GREEN) > 1e-4
