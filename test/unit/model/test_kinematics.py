"""Kinematics and dynamics: against the original C++ program (RBDL), finite differences and PyBullet's robots."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.needs import pybullet_robot

from solfer.errors import ModelError, UnknownName
from solfer.model import Description, Kinematics
from solfer.numerics.rotations import rotation_from_rpy

ROOT = Path(__file__).parents[3]
POINTS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_7", "arm2_7", "pelvis", "torso_2")
INERTIAL = (
    '<inertial><origin xyz="0.1 0 0.02"/><mass value="2"/>'
    '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'
)
ARM = f"""<robot name="arm">
  <link name="table"/><link name="upper">{INERTIAL}</link><link name="fore">{INERTIAL}</link>
  <link name="hand">{INERTIAL}</link><link name="tip"/>
  <joint name="shoulder" type="continuous"><parent link="table"/><child link="upper"/><axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.5 0 0" rpy="0.3 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" velocity="3" effort="40"/></joint>
  <joint name="slide" type="prismatic"><parent link="fore"/><child link="hand"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.2" velocity="0.1" effort="100"/></joint>
  <joint name="tip" type="fixed"><parent link="hand"/><child link="tip"/><origin xyz="0.1 0 0"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def original():
    content = json.loads((ROOT / "test/data/original_at_one_state.json").read_text())
    return {key: np.array(value) for key, value in content.items()}


@pytest.fixture(scope="module")
def centauro():
    return Kinematics(Description.from_file(ROOT / "config/robots/centauro/centauro.urdf"))


def arm(floating_base=None):
    return Kinematics(Description.from_text(ARM), floating_base)


def quadruped():
    return Kinematics(Description.from_file(pybullet_robot("a1/a1.urdf")), floating_base=True)


def kuka():
    return Kinematics(Description.from_file(pybullet_robot("kuka_iiwa/model.urdf")))


def test_dofs_have_the_order_of_the_original(centauro, original):
    assert centauro.dofs == ("x", "y", "z", "rx", "ry", "rz", *original["joints"][6:])
    assert centauro.size == 48
    assert centauro.mass == pytest.approx(float(original["mass"]), abs=1e-9)
    assert_allclose(centauro.gravity, (0, 0, -9.81))


def test_kinematics_agree_with_the_original(centauro, original):
    centauro.update(original["q"], original["qd"])
    assert_allclose(np.concatenate([centauro.position(link) for link in POINTS]), original["P"], atol=1e-9)
    jacobian = np.vstack([centauro.jacobian(link)[:3] for link in POINTS])
    assert_allclose(jacobian, original["J"].reshape(24, 48), atol=1e-9)
    assert_allclose(centauro.center_of_mass, original["com"], atol=1e-9)
    assert_allclose(centauro.center_of_mass_jacobian, original["Jcom"].reshape(3, 48), atol=1e-9)


def test_dynamics_agree_with_the_original(centauro, original):
    inertia = centauro.inertia(original["q"])
    assert_allclose(inertia, original["M"].reshape(48, 48), atol=1e-9)
    assert_allclose(centauro.bias(original["q"], original["qd"]), original["nle"], atol=1e-9)


def test_dynamics_of_another_state_leave_the_kinematics_alone(centauro, original):
    centauro.update(original["q"])
    before = centauro.position("arm1_7").copy()
    centauro.inertia(np.zeros(48))
    centauro.bias(np.zeros(48), np.ones(48))
    assert_allclose(centauro.position("arm1_7"), before, atol=0)


@pytest.mark.parametrize("make", [arm, lambda: arm(floating_base=True), quadruped, kuka])
def test_jacobians_and_velocities_are_derivatives(make):
    """Central differences along a random velocity are the oracle for each link and the centre of mass."""
    kinematics, random = make(), np.random.default_rng(7)
    links, step = list(kinematics.description.links)[1:], 1e-6
    q, v = random.uniform(-0.7, 0.7, (2, kinematics.size))
    before, after = {}, {}
    for sign, kept in ((-1, before), (1, after)):
        kinematics.update(q + sign * step * v)
        kept |= {link: (kinematics.position(link).copy(), kinematics.rotation(link).copy()) for link in links}
        kept["com"] = kinematics.center_of_mass.copy()
    kinematics.update(q, v)
    for link in links:
        linear = (after[link][0] - before[link][0]) / (2 * step)
        spin = (after[link][1] - before[link][1]) / (2 * step) @ kinematics.rotation(link).T
        twist = np.array((*linear, spin[2, 1], spin[0, 2], spin[1, 0]))
        assert_allclose(kinematics.jacobian(link) @ v, twist, atol=1e-7)
        assert_allclose(kinematics.velocity(link), twist, atol=1e-7)
    assert_allclose(kinematics.center_of_mass_jacobian @ v, (after["com"] - before["com"]) / (2 * step), atol=1e-7)


@pytest.mark.parametrize("make", [arm, quadruped, kuka])
def test_gravity_is_the_slope_of_the_potential(make):
    """The height of the centre of mass gives gravity without any dynamics; inertia is symmetric and positive."""
    kinematics, step = make(), 1e-6
    q = np.random.default_rng(11).uniform(-0.7, 0.7, kinematics.size)
    inertia = kinematics.inertia(q)
    assert_allclose(inertia, inertia.T, atol=1e-12)
    assert np.linalg.eigvalsh(inertia).min() > 0
    slope = np.zeros(kinematics.size)
    for dof in range(kinematics.size):
        heights = []
        for sign in (1, -1):
            moved = q.copy()
            moved[dof] += sign * step
            kinematics.update(moved)
            heights.append(kinematics.center_of_mass[2])
        slope[dof] = kinematics.mass * 9.81 * (heights[0] - heights[1]) / (2 * step)
    assert_allclose(kinematics.bias(q, np.zeros(kinematics.size)), slope, atol=1e-5)


def test_continuous_joints_are_one_number():
    kinematics = arm()
    assert kinematics.dofs == ("shoulder", "elbow", "slide")
    kinematics.update(np.array((7.5, 0.0, 0.0)))
    assert_allclose(kinematics.rotation("upper"), rotation_from_rpy((0, 0, 7.5)), atol=1e-12)
    assert_allclose(kinematics.lower_position, (-np.inf, -1, 0))
    assert_allclose(kinematics.upper_position, (np.inf, 2, 0.2))
    assert_allclose(kinematics.velocity_limit, (np.inf, 3, 0.1))
    assert_allclose(kinematics.effort_limit, (np.inf, 40, 100))


def test_base_starts_at_the_floating_joints_origin(centauro):
    q = np.zeros(48)
    q[:6] = (0.1, -0.2, 0.3, 0.4, -0.5, 0.6)
    centauro.update(q)
    position, quaternion = centauro.base.to_pose(q[:6])
    assert_allclose(position, (0.1, -0.2, 0.3 + 0.93445))
    assert_allclose(centauro.position("pelvis"), position, atol=1e-12)
    assert_allclose(centauro.base.from_pose(position, quaternion, np.empty(6)), q[:6], atol=1e-12)
    assert centauro.base_link == "pelvis" and np.isinf(centauro.lower_position[:6]).all()


def test_a_floating_base_is_added_or_removed(centauro):
    kinematics = arm(floating_base=True)
    assert kinematics.dofs == ("x", "y", "z", "rx", "ry", "rz", "shoulder", "elbow", "slide")
    assert kinematics.base_link == "table"
    assert arm().base is None and arm().base_link is None
    fixed = Kinematics(centauro.description, floating_base=False)
    assert fixed.dofs == centauro.dofs[6:] and fixed.base is None
    assert_allclose(fixed.position("pelvis"), (0, 0, 0.93445))


def test_positions_are_read_only(centauro, original):
    centauro.update(np.zeros(48))
    zero = centauro.position("wheel_1").copy()
    centauro.update(original["q"])
    position = centauro.position("wheel_1")
    assert_allclose(position, original["P"][:3], atol=1e-9)
    assert not np.allclose(zero, position)
    out = np.zeros((6, 48))
    assert centauro.jacobian("wheel_1", out) is out
    with pytest.raises(ValueError, match="read-only"):
        position[0] = 1.0


def test_a_link_with_a_joints_name_is_found(centauro):
    assert "velodyne_calib" in centauro.description.links and "velodyne_calib" in centauro.description.joints
    centauro.update(np.zeros(48))
    tip = arm()
    tip.update(np.zeros(3))
    assert_allclose(tip.position("tip"), (0.6, 0, 0), atol=1e-12)


@pytest.mark.parametrize("call", ["position", "rotation", "jacobian", "velocity", "frame"])
def test_unknown_link_offers_the_nearest(centauro, call):
    with pytest.raises(UnknownName, match="unknown link 'wheel1'") as caught:
        getattr(centauro, call)("wheel1")
    assert "wheel_1" in caught.value.names


def test_robots_that_cannot_be_used_are_refused():
    with pytest.raises(ModelError, match="no moving joint"):
        Kinematics(Description.from_text('<robot name="stone"><link name="stone"/></robot>'))
    clash = ARM.replace('name="elbow"', 'name="rx"')
    with pytest.raises(ModelError, match="name of a DoF of the base: rx"):
        Kinematics(Description.from_text(clash), floating_base=True)


def test_twins_have_states_of_their_own():
    """Twins share a model: an update of one must not move the other, nor lose the rotors' inertia."""
    first = arm()
    position, other = np.array([0.3, 0.5, 0.1]), np.array([-1.0, 1.2, 0.0])
    first.tree.armature[:] = 0.1, 0.2, 0.3
    first.update(position, other)
    expected, inertia = arm(), first.inertia(position).copy()
    expected.update(other, position)
    twin = first.twin()
    twin.update(other, position)
    before = first.position("tip").copy(), first.velocity("tip")
    for value, correct in (
        (twin.position("tip"), expected.position("tip")),
        (twin.velocity("tip"), expected.velocity("tip")),
    ):
        assert_allclose(value, correct, atol=0.0)
    twin.inertia(other)
    assert_allclose(first.position("tip"), before[0], atol=0.0)
    assert_allclose(first.velocity("tip"), before[1], atol=0.0)
    assert_allclose(first.inertia(position), inertia, atol=0.0)
    assert_allclose(twin.tree.armature, first.tree.armature, atol=0.0)
    assert np.abs(twin.position("tip") - before[0]).max() > 0.1


def test_a_robot_of_one_dof():
    """Its Jacobians are matrices of one column, too."""
    inertia = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    inertial = f'<inertial><origin xyz="1 0 0"/><mass value="1"/>{inertia}</inertial>'
    kinematics = Kinematics(
        Description.from_text(
            f'<robot name="r"><link name="a"/><link name="b">{inertial}</link><joint name="j" type="continuous">'
            '<origin xyz="0 0 1"/><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>'
        )
    )
    kinematics.update(np.zeros(1), np.array([2.0]))
    np.testing.assert_allclose(kinematics.jacobian("b"), [[0], [0], [0], [0], [0], [1]], atol=1e-12)
    np.testing.assert_allclose(kinematics.jacobian("b", np.empty((6, 1)))[:, 0], [0, 0, 0, 0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(kinematics.velocity("b"), [0, 0, 0, 0, 0, 2], atol=1e-12)
    np.testing.assert_allclose(kinematics.center_of_mass_jacobian, [[0], [1], [0]], atol=1e-12)
