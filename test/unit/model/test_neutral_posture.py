"""The neutral posture, against the geometry of legs that are drawn on paper."""

import numpy as np
import pytest
from support.needs import pybullet_robot

from solfer.model import Description, Kinematics
from solfer.model.neutral_posture import neutral_posture

LEG = """<robot name="hopper"><link name="trunk"/><link name="thigh"/><link name="shank"/><link name="foot"/>
  <joint name="hip" type="{hip}"><parent link="trunk"/><child link="thigh"/><axis xyz="0 1 0"/>
    <limit lower="{low}" upper="3" velocity="1" effort="1"/></joint>
  <joint name="knee" type="revolute"><parent link="thigh"/><child link="shank"/><origin xyz="0 0 -0.4"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="{straight}" velocity="1" effort="1"/></joint>
  <joint name="sole" type="fixed"><parent link="shank"/><child link="foot"/><origin xyz="0 0 -0.3"/></joint></robot>"""


def posture(floating, straight, hip="revolute", low=-3.0):
    """Compute the positions of hip and knee."""
    description = Description.from_text(LEG.format(straight=straight, hip=hip, low=low))
    return neutral_posture(Kinematics(description, floating))[6 if floating else 0 :]


def test_a_robot_is_at_zero_where_possible():
    np.testing.assert_array_equal(posture(True, 0.5), (0.0, 0.0))


def test_joints_on_a_fixed_base_are_nearest_zero():
    np.testing.assert_array_equal(posture(False, -0.9), (0.0, -0.9))


def test_a_bent_knee_keeps_foot_under_hip():
    """0.4 sin(hip) + 0.3 sin(hip + knee) = 0."""
    hip, knee = posture(True, -0.9)
    assert knee == -0.9
    assert hip == pytest.approx(np.arctan2(0.3 * np.sin(0.9), 0.4 + 0.3 * np.cos(0.9)))


def test_limits_hold_with_an_unreachable_foot():
    np.testing.assert_array_equal(posture(True, -0.9, low=3.0), (3.0, -0.9))
    np.testing.assert_array_equal(posture(True, -0.9, hip="fixed"), (-0.9,))


def test_a_quadruped_of_pybullet_stands_as_drawn():
    description = Description.from_file(pybullet_robot("a1/a1.urdf"))
    kinematics = Kinematics(description, True)
    feet = [f"{leg}_toe" for leg in ("FR", "FL", "RR", "RL")]
    kinematics.update(np.zeros(kinematics.size))
    drawn = [kinematics.position(foot)[:2].copy() for foot in feet]
    bent = neutral_posture(kinematics)
    kinematics.update(bent)
    np.testing.assert_allclose([kinematics.position(foot)[:2] for foot in feet], drawn, atol=1e-6)
    assert (bent >= kinematics.lower_position).all() and (bent <= kinematics.upper_position).all()
