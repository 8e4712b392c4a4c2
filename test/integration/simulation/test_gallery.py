"""The gallery: its script draws two robots, and its page has a picture of each."""

import json
import logging
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

REPOSITORY = Path(__file__).parents[3]


def run(folder, *arguments):
    """Run the script."""
    command = [sys.executable, str(REPOSITORY / "benchmark/gallery.py"), "--folder", str(folder), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=200, check=False)


@pytest.mark.slow
def test_an_arm_reaches_and_wheels_drive(tmp_path):
    """Each picture has the robot's colours before floor and sky, and progress is on stderr."""
    names = ("kuka_iiwa", "wheeled_go2")
    done = run(tmp_path, "--json", "--robots", *names)
    assert done.returncode == 0, done.stdout + done.stderr
    assert [json.loads(line)["name"] for line in done.stdout.splitlines()] == list(names)
    assert [line for line in done.stderr.splitlines() if line[1:3] == "/2"] == ["1/2 kuka_iiwa", "2/2 wheeled_go2"]
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.jpg" for name in names}
    with Image.open(tmp_path / "kuka_iiwa.jpg") as picture:
        red, _, blue = np.moveaxis(np.asarray(picture, dtype=int), 2, 0)
    assert picture.size == (360, 300) and 500 < np.count_nonzero(blue > red + 60) < 20000


def test_the_page_has_every_robot_once():
    page = (REPOSITORY / "docs/tutorials/gallery.md").read_text()
    pictures = re.findall(r"\]\(\.\./pictures/gallery/(\S+)\.jpg\)", page)
    assert pictures == [line.split()[0] for line in page.split("```")[3].splitlines() if line]
    files = list((REPOSITORY / "docs/pictures/gallery").iterdir())
    assert sorted(pictures) == sorted(path.stem for path in files)
    assert sum(path.stat().st_size for path in files) < 1_500_000
    assert len(pictures) >= 12


@pytest.mark.slow
def test_a_robot_that_does_not_get_there_is_an_error(tmp_path, monkeypatch, capsys):
    """TIAGo's tip cannot go up by a metre."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "benchmark"))
    import gallery

    far = gallery.example("tiago_description/robots/tiago_no_hand", floating=False, way=(0.0, 0.0, 1.0))
    monkeypatch.setattr(logging, "disable", lambda level: None)  # which would last for other tests
    monkeypatch.setitem(gallery.ROBOTS, "tiago", far)
    monkeypatch.setattr(sys, "argv", ["gallery.py", "--robots", "tiago", "--folder", str(tmp_path)])
    assert gallery.main() == 1
    assert " away_mm" in capsys.readouterr().out
