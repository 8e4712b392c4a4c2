"""Default gains, against inertia that is known in closed form."""

import numpy as np
import pytest

from solfer.lower_level.gains import default_gains, moved_inertia
from solfer.model import Description, Kinematics

LIMITED, UNLIMITED = '<limit effort="100" velocity="1"/>', ""
URDF = """<robot name="two">
  <link name="body"><inertial><mass value="10"/>
    <inertia ixx="1" iyy="2" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="continuous"><parent link="body"/><child link="rod"/><origin xyz="0.3 0 0" rpy="0 0 0.4"/>
    <axis xyz="0 0 1"/>{limit}</joint></robot>"""
ROD = 0.1  # [kg m^2] about the joint's axis, on which its centre of mass lies
BODY = (3.0 + 10.0 * 0.3**2) / 4.0  # parallel axis theorem; a quarter of it for each of four legs


def model(limit, floating):
    """The two links and the DoF between them."""
    kinematics = Kinematics(Description.from_text(URDF.format(limit=limit)), floating)
    return kinematics, np.array([kinematics.dofs.index("swing")])


@pytest.mark.parametrize("floating, inertia", [(False, ROD), (True, BODY)])
def test_a_joint_moves_what_it_carries_or_what_carries_it(floating, inertia):
    assert moved_inertia(*model(LIMITED, floating)) == pytest.approx([inertia])


def test_the_effort_limit_is_used_and_the_damping_is_critical():
    stiffness, damping = default_gains(*model(LIMITED, True))
    assert stiffness == pytest.approx([100.0 / 0.05])
    assert damping == pytest.approx([2.0 * np.sqrt(2000.0 * BODY)])


@pytest.mark.parametrize("limit", [LIMITED, UNLIMITED])
def test_a_light_link_gets_no_faster_than_the_bound(limit):
    stiffness, _ = default_gains(*model(limit, False))
    assert np.sqrt(stiffness / ROD) == pytest.approx([100.0])
