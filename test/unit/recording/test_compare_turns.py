"""Comparison of recordings of continuous joints that were counted differently."""

import math

import numpy as np
import pytest

from solfer.recording.model import JOINTS_KIND, Channel, Recording
from solfer_tools.review import Difference, compare

NAMES, RATE, DURATION = ("wheel", "knee", "hip"), 200.0, 12.0
URDF = b"""<robot name="r"><joint name="wheel" type="continuous"/><joint name="knee" type="revolute"/>
<joint name="hip" type="revolute"/></robot>"""


def recording(change=lambda positions: positions, urdf=URDF):
    """Record a wheel that turns on and two joints that swing; `change` gets their positions, shape (T, 3)."""
    times = np.arange(0.0, DURATION, 1.0 / RATE)
    swing = [0.4 * np.sin(1.3 * times), 0.3 * np.sin(2.1 * times) + 0.1 * np.sin(0.7 * times)]
    positions = np.stack([2.0 * times + 0.5 * np.sin(1.7 * times), *swing], axis=1)
    name = "plugin/feedback/pipe/position"
    channel = Channel(name, JOINTS_KIND, NAMES, ("rad",) * 3, "", times, change(positions))
    return Recording({name: channel}, (), {"robot.urdf": urdf})


def wrapped(positions):
    """Count the wheel in (-pi, pi]."""
    positions[:, 0] = math.pi - (math.pi - positions[:, 0]) % math.tau
    return positions


def turned(joint, turns):
    """Let a joint begin on another turn."""

    def change(positions):
        positions[:, joint] += math.tau * turns
        return positions

    return change


@pytest.mark.parametrize("change", [wrapped, turned(0, 3), turned(0, -41)], ids=["wraps", "three turns", "-41 turns"])
def test_the_count_of_a_continuous_joint_is_no_difference(change):
    same, found = compare(recording(), recording()), compare(recording(), recording(change))
    assert not found.different and found.shift == pytest.approx(same.shift, abs=1e-9)
    assert found.second == pytest.approx(same.second, abs=1e-9)
    assert not compare(recording(change), recording()).different


def test_another_angle_of_it_is_one():
    (verdict,) = compare(recording(), recording(turned(0, 3.05))).different
    assert verdict.joint == "wheel" and verdict.differences == (Difference.OFFSET,)


def test_a_turn_of_another_joint_is_one():
    (verdict,) = compare(recording(), recording(turned(1, 1))).different
    assert verdict.joint == "knee"
