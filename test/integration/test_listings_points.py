"""Listings 2, 3 and 4 of the paper, the examples, on CENTAURO and on Solo 12."""

import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
import pytest

from solfer import Robot

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CENTAURO = EXAMPLES.parent / "config/robots/centauro/centauro.urdf"
SOLO = "cmeel.prefix/share/example-robot-data/robots/solo_description/robots/solo12.urdf"


def solo() -> str:
    """The URDF of Solo 12; without it the test is skipped."""
    try:
        return str(distribution("example-robot-data").locate_file(SOLO))
    except PackageNotFoundError:
        pytest.skip("needs pip install -r requirements-examples.txt")


def numbers(name: str, *arguments: str) -> list[float]:
    """Numbers with a decimal point that an example prints."""
    command = [sys.executable, str(EXAMPLES / name), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return [float(number) for number in re.findall(r"\d+\.\d{6}", done.stdout)]


def test_listing_2_brings_a_hand_to_its_reference():
    assert numbers("listing_2.py") == [pytest.approx(0.0, abs=1e-3)]


def test_listing_2_brings_a_foot_of_solo_to_its_reference():
    assert numbers("listing_2.py", "--urdf", solo(), "--link", "FL_FOOT") == [pytest.approx(0.0, abs=1e-3)]


def test_listing_3_brings_the_centre_of_mass_and_two_hands_to_their_references():
    assert numbers("listing_3.py") == [pytest.approx(0.0, abs=1e-3)]


def test_listing_3_works_on_solo():
    links = ("--links", "FL_FOOT", "FR_FOOT", "base_link")
    assert numbers("listing_3.py", "--urdf", solo(), *links) == [pytest.approx(0.0, abs=1e-3)]


@pytest.mark.parametrize("name", ["centauro", "solo"])
def test_listing_4_tells_the_distances_between_points_before_the_hands_and_the_base(name):
    urdf = CENTAURO if name == "centauro" else solo()
    hands, base = (("arm1_7", "arm2_7"), "pelvis") if name == "centauro" else (("FL_FOOT", "HR_FOOT"), "base_link")
    told = numbers("listing_4.py", "--urdf", str(urdf), "--hands", *hands, "--base", base)
    robot = Robot.load(urdf, floating_base=True)
    expected = []
    for angle in (0.0, 0.3, 0.6):
        robot.state.position[6:] = angle
        robot.update()
        kinematics = robot.kinematics
        for hand in hands:
            point = kinematics.position(hand) + kinematics.rotation(hand) @ (0.0, 0.0, -0.15)
            expected.append(np.linalg.norm(point - kinematics.position(base)))
    assert told == pytest.approx(expected, abs=1e-6)
