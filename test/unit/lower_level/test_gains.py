"""Default gains, against inertia and weight that are known in closed form."""

import numpy as np
import pinocchio
import pytest

from solfer.config.yaml.folders import Folders
from solfer.errors import UnknownName
from solfer.lower_level import ImpedanceController, JointLimits
from solfer.lower_level.gains.defaults import default_gains, free_inertia, moved_inertia
from solfer.lower_level.gains.file import read_gains
from solfer.model import Description, Kinematics

LIMITED, UNLIMITED = '<limit effort="100" velocity="1"/>', ""
URDF = """<robot name="two">
  <link name="body"><inertial><mass value="10"/>
    <inertia ixx="1" iyy="2" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="continuous"><parent link="body"/><child link="rod"/><origin xyz="0.3 0 0" rpy="0 0 0.4"/>
    <axis xyz="{axis}"/>{limit}</joint></robot>"""
ROD = 0.1  # [kg m^2] about the vertical joint's axis, on which its centre of mass lies
BODY = 3.0 + 10.0 * 0.3**2  # parallel axis theorem


def model(limit, floating, axis="0 0 1"):
    """Make kinematics of the two links; return it with the DoF between them and a posture at zero."""
    kinematics = Kinematics(Description.from_text(URDF.format(limit=limit, axis=axis)), floating)
    return kinematics, np.array([kinematics.dofs.index("swing")]), np.zeros(kinematics.size)


@pytest.mark.parametrize("floating, inertia", [(False, ROD), (True, BODY)])
def test_a_joint_moves_the_heavier_side(floating, inertia):
    assert moved_inertia(*model(LIMITED, floating)) == pytest.approx([inertia])


def test_a_free_joint_moves_both_bodies():
    """The articulated body algorithm needs no inertia matrix: at rest and with a torque on the joint, a = 1 / m."""
    kinematics, dofs, posture = model(LIMITED, True)
    effort = kinematics.bias(posture, posture).copy()
    effort[dofs] += 1.0
    acceleration = pinocchio.aba(kinematics._model, kinematics._model.createData(), posture, posture, effort)
    assert free_inertia(kinematics, posture)[dofs] == pytest.approx(1.0 / acceleration[dofs], rel=1e-6)
    assert free_inertia(kinematics, posture)[dofs] < ROD


def test_a_fixed_base_has_critical_damping():
    kinematics, dofs, _ = model('<limit effort="1" velocity="1"/>', False)
    stiffness, damping = default_gains(kinematics, dofs)
    assert stiffness == pytest.approx([1.0 / 0.05])
    assert damping == pytest.approx([2.0 * np.sqrt(20.0 * ROD)])


def test_weight_on_a_joint_makes_it_stiffer():
    kinematics, dofs, posture = model('<limit effort="1" velocity="1"/>', False, "0 1 0")
    posture[dofs] = 0.5
    stiffness, damping = default_gains(kinematics, dofs, posture)
    inertia, weight = 0.1 + 2.0 * 0.5**2, 2.0 * 9.81 * 0.5 * np.sin(0.5)
    assert stiffness == pytest.approx([weight / 0.01])
    assert damping == pytest.approx([2.0 * np.sqrt(weight / 0.01 * inertia)])


def test_the_damping_of_a_standing_leg_keeps_to_the_step():
    kinematics, dofs, posture = model(LIMITED, True)
    stiffness, damping = default_gains(kinematics, dofs)
    free = free_inertia(kinematics, posture)[dofs]
    assert stiffness == pytest.approx(100.0 / 0.05)
    assert damping == pytest.approx(0.5 * free / 0.001)


def test_a_light_leg_keeps_to_the_step():
    kinematics, dofs, posture = model('<limit effort="1e4" velocity="1"/>', True)
    free = free_inertia(kinematics, posture)[dofs]
    assert free * 500.0**2 < BODY * 100.0**2
    assert default_gains(kinematics, dofs)[0] == pytest.approx(free * 500.0**2)


def test_friction_holds_no_joint_far_from_its_command():
    limit = '<limit effort="1e4" velocity="1"/><dynamics friction="40"/>'
    stiffness, _ = default_gains(*model(limit, False)[:2])
    without, _ = default_gains(*model('<limit effort="1e4" velocity="1"/>', False)[:2])
    assert without < 1900.0 and stiffness >= 40.0 / 0.02


@pytest.mark.parametrize("limit", [LIMITED, UNLIMITED])
def test_a_light_link_keeps_to_the_bound(limit):
    stiffness, damping = default_gains(*model(limit, False)[:2])
    assert stiffness == pytest.approx(ROD * 100.0**2)
    assert damping == pytest.approx(2.0 * 100.0 * ROD)


def test_the_first_joint_without_gains_is_named(tmp_path):
    joints, ones = ("hip", "knee", "ankle"), np.ones(3)
    legs = ImpedanceController("legs", JointLimits(joints, np.arange(3), -ones, ones, ones, ones), ones, ones)
    file = tmp_path / "gains.yaml"
    file.write_text("gains:\n  hip: {stiffness: 1.0, damping: 1.0}\n")
    with pytest.raises(UnknownName, match="unknown joint 'knee'"):
        read_gains(legs, str(file), Folders([tmp_path]))
