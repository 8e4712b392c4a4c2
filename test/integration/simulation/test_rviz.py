"""`figure_5.launch rviz:=true` on a display in memory: what RViz draws, and the picture of the page."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

REPOSITORY = Path(__file__).parents[3]
GREEN = (26, 178, 51)
"""Colour of the support polygon."""


def share(picture: Path, color: tuple[int, int, int]) -> float:
    """Share of the pixels that have a colour, about."""
    pixels = np.asarray(Image.open(picture).convert("RGB"), dtype=float)
    return float((np.abs(pixels - color).max(axis=2) < 40.0).mean())


@pytest.mark.soak
def test_rviz_draws_the_scene(tmp_path):
    picture = tmp_path / "rviz.png"
    command = [sys.executable, str(REPOSITORY / "benchmark/rviz.py"), str(picture)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert share(picture, GREEN) > 5e-4, "no support polygon"


def test_the_page_has_the_picture():
    assert "](../pictures/rviz.png)" in (REPOSITORY / "docs/how-to/rviz.md").read_text()
    assert share(REPOSITORY / "docs/pictures/rviz.png", GREEN) > 5e-4
