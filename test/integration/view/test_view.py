"""`solfer view` as a process: the commands of docs/view.md, with a page without a browser, and in Debian's Chromium."""

import re
import shutil
import signal
import subprocess
import time
from contextlib import contextmanager

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.browser import CHROMIUM, browser  # noqa: E402
from support.page import opened_page  # noqa: E402

ADDRESS = re.compile(r"http://localhost:\d+/[\w-]{20,}/\n")


@contextmanager
def view(repository, *words):
    """Start `solfer view` on any port; yields its address."""
    command = [shutil.which("solfer"), "view", "--port", "0", *words]
    with subprocess.Popen(command, cwd=repository, stdout=subprocess.PIPE, text=True) as process:
        try:
            first = process.stdout.readline()
            assert ADDRESS.fullmatch(first), first
            yield first.strip()
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(20.0) == 0


@pytest.mark.slow
def test_a_study_drives_on_the_page(repository):
    (line,) = re.findall(
        r"^solfer view (--run \S+ --control)$", (repository / "docs/view.md").read_text(), re.MULTILINE
    )
    with view(repository, *line.split()) as address, opened_page(address) as page:
        end = time.monotonic() + 60.0
        places = []
        while time.monotonic() < end and (len(places) < 2 or np.linalg.norm(places[-1] - places[0]) < 0.01):
            page.receive(0.3)
            if "/measured/pelvis" in page.positions:
                places.append(np.array(page.positions["/measured/pelvis"]))
        assert np.linalg.norm(places[-1] - places[0]) >= 0.01, "it does not move"
        texts = " ".join(str(props.get("content", "")) for props in page.gui.values())
        assert "wheeled_motion" in str(page.gui.values()) and "running" in texts
        page.click("take control")
        page.receive(1.0)
        assert any("commands" in str(props.get("_markdown")) for props in page.gui.values())


@pytest.mark.soak
@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium")
def test_chromium_draws_the_page(repository, tmp_path):
    with view(repository, "--run", "config/studies/robustness.yaml") as address:
        with browser(tmp_path / "profile", address) as seen:
            seen.wait("(document.getElementById('solfer-beat')?.dataset.count ?? 0) > 20")
            seen.picture(tmp_path / "view.png")
            assert share(tmp_path / "view.png", GREEN) > 1e-4, "no support polygon"
            seen.click("EMERGENCY STOP")
            seen.click("stop the robot now")
            seen.wait("!document.body.innerText.includes('stop the robot now')")


GREEN = (60, 190, 70)


def share(picture, color):
    """Share of the pixels that have a colour, about."""
    image = pytest.importorskip("PIL.Image")
    pixels = np.asarray(image.open(picture).convert("RGB"), dtype=float)
    return float((np.abs(pixels - color).max(axis=2) < 40.0).mean())


def test_the_page_of_the_docs_has_the_picture(repository):
    assert "](view.png)" in (repository / "docs/view.md").read_text()
    assert share(repository / "docs/view.png", GREEN) > 1e-4
