"""Points alone: values, offsets, conventions, algebra, contacts, and refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from support.robots import centauro

from solfer.errors import NotFinite, SizeMismatch, UnknownName
from solfer.model.contacts import read_contacts
from solfer.points import (
    ORIENTATION,
    POSE,
    CenterOfMass,
    CenterOfPressure,
    Constant,
    DynamicPoint,
    FrameOrientation,
    LinearPoint,
    LinearVelocity,
    Minus,
    Norm,
    Plus,
    Point,
    PointContact,
    RollingContact,
    SpatialPoint,
    SpatialVelocity,
    SupportVertex,
    make_contact,
)
from solfer.points.program import CompiledPoint

ROOT = Path(__file__).parents[3]
CENTAURO = ROOT / "config/robots/centauro"
POINTS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_7", "arm2_7", "pelvis", "torso_2")


@pytest.fixture(scope="module")
def original():
    content = json.loads((ROOT / "test/data/original_at_one_state.json").read_text())
    return {key: np.array(value) for key, value in content.items()}


@pytest.fixture
def robot(original):
    robot = centauro(contacts=False)
    robot.state.position[:], robot.state.velocity[:] = original["q"], original["qd"]
    robot.update()
    return robot


def updated(*points):
    for point in points:
        point.update()
    return points[-1]


def test_points_agree_with_the_original(robot, original):
    points = [updated(LinearPoint(link, robot)) for link in POINTS]
    assert_allclose(np.concatenate([point.value for point in points]), original["P"], atol=1e-9)
    assert_allclose(np.vstack([point.jacobian for point in points]), original["J"].reshape(24, 48), atol=1e-9)
    center = updated(CenterOfMass(robot))
    assert_allclose(center.value, original["com"], atol=1e-9)
    assert_allclose(center.jacobian, original["Jcom"].reshape(3, 48), atol=1e-9)


def test_contacts_agree_with_the_original(robot, original):
    records = [record for record in read_contacts(CENTAURO / "contacts.yaml", "centauro") if record.type == "wheel"]
    contacts = [updated(make_contact(record, robot)) for record in records]
    assert_allclose(np.concatenate([contact.value for contact in contacts]), original["contact_points"], atol=1e-9)
    # the original gives each Jacobian in the axes of its wheel's link
    jacobians = [robot.kinematics.rotation(contact.link).T @ contact.jacobian for contact in contacts]
    assert_allclose(np.vstack(jacobians), original["Jc"].reshape(12, 48), atol=1e-9)


def test_orientations_are_right_in_every_convention(robot):
    point = updated(FrameOrientation("arm1_7", robot))
    x, y, z, w = Rotation.from_matrix(robot.kinematics.rotation("arm1_7")).as_quat(canonical=True)
    assert_allclose(point.value, (x, y, z, w), atol=1e-12)
    assert_allclose(point.quaternion("wxyz", "JPL"), (w, -x, -y, -z), atol=1e-12)
    point.set_world((w, -x, -y, -z), "wxyz", "JPL")
    assert_allclose(point.orientation.fixed, (0, 0, 0, 1), atol=1e-12)
    with pytest.raises(UnknownName, match="order of a quaternion 'wxzy'") as error:
        point.quaternion("wxzy")
    assert "wxyz" in error.value.names
    with pytest.raises(UnknownName, match="kind of quaternions"):
        point.set_fixed((0, 0, 0, 1), kind="Hamilton's")


@pytest.mark.parametrize("axis", [*np.eye(3), (1e-9, 1.0, 1e-9), (0.0, 0.2, 1.0), (1.0, 0.2, 0.1)])
def test_quaternions_of_half_turns_are_exact_and_never_below_zero(robot, axis):
    """Each branch of the formula, and both signs that its w has before it is turned over."""
    point = FrameOrientation("pelvis", robot)
    for angle in (np.pi, 3.0, -3.0, 2.2, -2.2):
        for fixed in (Rotation.identity(), Rotation.from_rotvec((0.0, 3.0, 0.5))):
            turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
            robot.state.position[3:6] = turn.as_euler("XYZ")
            robot.update()
            point.set_fixed(fixed.as_quat())
            updated(point)
            expected = Rotation.from_matrix(robot.kinematics.rotation("pelvis")) * fixed
            assert (expected.inv() * Rotation.from_quat(point.value)).magnitude() < 1e-12
            assert point.value[3] >= 0.0 and np.linalg.norm(point.value) == pytest.approx(1.0, abs=1e-12)


def test_without_offsets_it_is_the_links_frame(robot):
    """The kinematics of the link are the oracle, also after an offset is set back to zero."""
    link = "arm1_7"
    position, jacobian = robot.kinematics.position(link), robot.kinematics.jacobian(link)
    turn = Rotation.from_matrix(robot.kinematics.rotation(link)).as_quat(canonical=True)
    moved = SpatialPoint(link, robot, (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0))
    moved.set_fixed((0.0, 0.0, 0.0))
    for point, value in (
        (LinearPoint(link, robot), position),
        (FrameOrientation(link, robot), turn),
        (SpatialPoint(link, robot), [*position, *turn]),
        (moved, [*position, *turn]),
    ):
        assert_allclose(updated(point).value, value, atol=1e-12)
    assert_allclose(moved.jacobian, jacobian, atol=1e-12)
    assert_allclose(updated(LinearVelocity(link, robot)).jacobian, jacobian[:3], atol=1e-12)
    assert_allclose(updated(SpatialVelocity(link, robot)).jacobian, jacobian, atol=1e-12)


def test_offsets_are_set_in_any_frame(robot):
    point, kinematics = LinearPoint("arm1_7", robot), robot.kinematics
    point.position.set_fixed((0.0, 0.0, -0.15))
    expected = kinematics.position("arm1_7") + kinematics.rotation("arm1_7") @ (0.0, 0.0, -0.15)
    assert_allclose(updated(point).value, expected, atol=1e-12)
    assert_allclose(point.position.fixed, (0.0, 0.0, -0.15), atol=1e-12)
    point.set_world((0.5, 0.4, 0.3))
    assert_allclose(updated(point).value, (0.5, 0.4, 0.3), atol=1e-12)
    point.set_reference((0.1, 0.0, 0.2), "torso_2")
    expected = kinematics.position("torso_2") + kinematics.rotation("torso_2") @ (0.1, 0.0, 0.2)
    assert_allclose(updated(point).value, expected, atol=1e-12)


def test_frames_are_turned_in_any_frame(robot):
    turn = Rotation.from_rotvec((0.3, -0.2, 0.9))
    frame = SpatialPoint("arm1_7", robot, (0.1, 0.0, 0.0), turn.as_quat())
    link = Rotation.from_matrix(robot.kinematics.rotation("arm1_7"))
    assert_allclose(updated(frame).value[3:], (link * turn).as_quat(canonical=True), atol=1e-12)
    frame.set_world((1.0, 2.0, 3.0), turn.as_quat())
    assert_allclose(updated(frame).value, (1.0, 2.0, 3.0, *turn.as_quat(canonical=True)), atol=1e-12)
    frame.set_reference((0.0, 0.0, 0.1), turn.as_quat(), "pelvis")
    pelvis = Rotation.from_matrix(robot.kinematics.rotation("pelvis"))
    assert_allclose(updated(frame).value[3:], (pelvis * turn).as_quat(canonical=True), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-10, 1e-3, 1.0, 3.1])
def test_differences_of_orientations_are_rotation_vectors(robot, angle):
    axis = np.array((0.6, 0.0, 0.8))
    first, second = Rotation.from_rotvec(angle * axis), Rotation.from_rotvec((1.0, 2.0, -0.5))
    difference = Constant((first * second).as_quat(), ORIENTATION).difference(-second.as_quat())
    assert_allclose(difference, angle * axis, atol=1e-12)


def test_sums_and_differences_follow_their_points(robot):
    first, second = LinearPoint("arm1_7", robot), LinearPoint("torso_2", robot)
    difference, total = first - second, first + (1.0, 0.0, 0.0)
    negative = np.zeros(3) - first
    assert isinstance(difference, Minus) and isinstance(total, Plus)
    for height in (0.0, 1.0):
        robot.state.position[2] = height
        robot.update()
        updated(first, second, difference, total, negative)
        assert_allclose(negative.value, -first.value)
        assert_allclose(negative.jacobian, -first.jacobian)
        assert_allclose(difference.value, first.value - second.value)
        assert_allclose(difference.jacobian, first.jacobian - second.jacobian)
        assert_allclose(total.value, first.value + (1.0, 0.0, 0.0))
        assert_allclose(total.jacobian, first.jacobian)


def test_assigned_values_hold_until_the_next_update(robot):
    """Points that depend on an assigned one follow its numbers, and an update restores all of them."""
    point, other = updated(LinearPoint("arm1_7", robot)), updated(LinearPoint("wheel_1", robot))
    difference = updated(point - other)
    value, jacobian = point.value.copy(), point.jacobian.copy()
    same = point
    point += other
    point -= (1.0, 2.0, 3.0)
    assert point is same
    assert_allclose(point.value, value + other.value - (1.0, 2.0, 3.0))
    assert_allclose(point.jacobian, jacobian + other.jacobian)
    assert_allclose(updated(difference).jacobian, jacobian, atol=1e-15)
    point.assign(other)
    assert_allclose(point.value, other.value)
    assert_allclose(point.jacobian, other.jacobian)
    assert_allclose(updated(difference).jacobian, np.zeros((3, 48)))
    updated(point)
    assert_allclose(point.value, value)
    assert_allclose(point.jacobian, jacobian)
    assert_allclose(updated(difference).jacobian, jacobian - other.jacobian)


def test_without_jacobian_only_the_value_is_computed(robot):
    point = updated(LinearPoint("arm1_7", robot))
    before = point.jacobian.copy()
    robot.state.position[:] = 0.0
    robot.update()
    point.update(jacobian=False)
    assert_allclose(point.value, robot.kinematics.position("arm1_7"))
    assert_allclose(point.jacobian, before)


def test_the_norm_has_no_slope_at_zero(robot):
    point = updated(LinearPoint("arm1_7", robot))
    norm = Norm(point)
    assert updated(norm).value[0] == pytest.approx(np.linalg.norm(point.value))
    assert_allclose(norm.jacobian, [point.value @ point.jacobian / norm.value])
    nothing = point - point
    assert updated(nothing, Norm(nothing)).value[0] == 0.0
    assert_allclose(updated(nothing, Norm(nothing)).jacobian, np.zeros((1, 48)))


def test_a_reference_may_have_a_jacobian(robot):
    point, reference = updated(LinearPoint("arm1_7", robot)), Constant(3)
    error = point - reference
    reference.set((1.0, 2.0, 3.0))
    reference.set(np.zeros((reference.rows, reference.cols)))
    assert Constant(np.int64(3)).size == 3
    assert_allclose(updated(error).value, point.value - (1.0, 2.0, 3.0))
    assert_allclose(error.jacobian, point.jacobian)
    reference.set(np.ones((3, 48)))
    assert_allclose(updated(error).jacobian, point.jacobian - 1.0)


def test_a_lifted_contact_has_no_jacobian(robot):
    contact = updated(PointContact("arm1_7", robot))
    jacobian = contact.jacobian.copy()
    assert jacobian.any() and contact.active
    contact.active = False
    assert not updated(contact).jacobian.any() and not contact.active
    assert_allclose(contact.value, robot.kinematics.position("arm1_7"))
    contact.active = True
    assert_allclose(updated(contact).jacobian, jacobian)


def test_the_centre_of_pressure_uses_normal_forces(robot):
    contacts = [updated(PointContact(link, robot)) for link in POINTS[:3]]
    center = updated(CenterOfPressure(contacts))
    assert_allclose(center.value, np.zeros(3))
    for contact, force in zip(contacts, (100.0, 300.0, -50.0), strict=True):
        contact.force[2] = force
    expected = 0.25 * contacts[0].value + 0.75 * contacts[1].value
    expected[2] = 0.0
    assert_allclose(updated(center).value, expected, atol=1e-12)
    contacts[0].active = False
    assert_allclose(updated(center).value[:2], contacts[1].value[:2], atol=1e-12)
    contacts[1].wrench = np.zeros(6)
    assert_allclose(updated(center).value[:2], contacts[1].value[:2], atol=1e-12)
    assert not center.jacobian.any()


def test_an_upright_wheels_vertex_is_below_it(robot):
    robot.state.position[:] = 0.0
    robot.update()
    axis = robot.kinematics.rotation("wheel_1").T @ (0.0, 1.0, 0.0)
    vertex = updated(SupportVertex("wheel_1", robot, ring=0.01, tube=0.068, axis=axis))
    assert_allclose(vertex.value, robot.kinematics.position("wheel_1") - (0.0, 0.0, 0.078), atol=1e-12)
    vertex.set_normal(robot.kinematics.rotation("wheel_1") @ axis)
    assert_allclose(updated(vertex).value, robot.kinematics.position("wheel_1") - (0.0, 0.068, 0.0), atol=1e-9)
    assert np.isfinite(vertex.jacobian).all()


def test_a_dynamic_point_adds_an_offset():
    """The smallest DynamicPoint a user can write: A x + b by hand is the oracle."""

    class Weight(DynamicPoint):
        """Force A x + b with x the accelerations."""

        @property
        def x(self):
            return self.robot.state.acceleration

        def compute_jacobian(self):
            self.jacobian[0, 0] = 2.0

        def compute_offset(self):
            self.offset[:] = 19.62

    robot = centauro(contacts=False)
    robot.state.acceleration[0] = 0.5
    assert updated(Weight(1, robot)).value[0] == pytest.approx(20.62)


def test_what_a_kind_of_point_lacks_is_named(robot):
    class Bare(Point):
        """Computes nothing."""

    for kind, lacks in (
        (Bare, "compute.*compute_jacobian"),
        (DynamicPoint, "compute_offset"),
        (CompiledPoint, "instructions"),
    ):
        with pytest.raises(TypeError, match=lacks):
            kind(1, robot)


def test_an_unknown_link_gives_nearest_names(robot):
    for kind in (LinearPoint, FrameOrientation, SpatialPoint, LinearVelocity, PointContact):
        with pytest.raises(UnknownName, match="unknown link 'arm1-7'") as error:
            kind("arm1-7", robot)
        assert "arm1_7" in error.value.names
    with pytest.raises(UnknownName):
        RollingContact("arm1-7", robot, 0.01, 0.068)
    with pytest.raises(UnknownName):
        LinearPoint("arm1_7", robot).set_reference((0.0, 0.0, 0.0), "pelviss")


@pytest.mark.parametrize("dof", [47, 48, 49])
def test_a_column_outside_the_jacobian_is_refused(robot, dof):
    """The kernel would write it behind the array."""

    class Wide(LinearPoint):
        def written_columns(self):
            return np.array([0, dof])

    point = Wide("arm1_7", robot)
    if dof < 48:
        point.update()
    else:
        with pytest.raises(SizeMismatch, match=f"a Jacobian of 48 columns, DoF {dof} moves it"):
            point.update()


def test_numbers_that_are_not_finite_are_refused(robot):
    """NaN, infinity, zero quaternions and zero axes are refused, and the reference keeps its former value."""
    reference = Constant((1.0, 2.0, 3.0))
    for values in ((np.nan, 0.0, 0.0), (0.0, np.inf, 0.0)):
        with pytest.raises(NotFinite):
            reference.set(values)
        with pytest.raises(NotFinite):
            LinearPoint("arm1_7", robot, values)
    with pytest.raises(NotFinite):
        reference -= (np.nan, 0.0, 0.0)
    assert_allclose(reference.value, (1.0, 2.0, 3.0))
    with pytest.raises(NotFinite):
        Constant((0.0, 0.0, 0.0, 0.0), ORIENTATION)
    with pytest.raises(NotFinite):
        Constant(POSE.neutral(), POSE).set((1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(NotFinite):
        SupportVertex("wheel_1", robot, 0.01, 0.068, axis=(0.0, 0.0, 0.0))
