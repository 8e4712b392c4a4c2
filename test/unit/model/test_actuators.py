"""Actuators of a robot."""

from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from solfer.errors import ConfigError, SolferErrors, UnknownName
from solfer.model import Actuators, Description, Kinematics, SeriesElastic

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
SPRING = SeriesElastic(100.0, 1.0, 0.5, 0.2, 30.0)


def write(folder, text):
    path = folder / "actuators.yaml"
    path.write_text(text)
    return path


def test_centauro_has_one_behind_every_joint():
    dofs = Kinematics(Description.from_file(CENTAURO / "centauro.urdf")).dofs
    actuators = Actuators.from_file(CENTAURO / "actuators.yaml", "centauro", dofs)
    assert actuators.names == dofs[6:] and len(actuators) == 42
    assert actuators["x"] is None
    assert_allclose(actuators.stiffness[:6], 0)
    # reflected rotors of the legs: hip pitch 1.48, hip yaw and ankle pitch 1.31, ankle yaw and wheel 0.088 kg m2
    assert actuators["hip_yaw_1"].motor_inertia == pytest.approx(1.31072)
    assert actuators["j_wheel_3"].motor_inertia == pytest.approx(0.0877)
    assert actuators["hip_yaw_1"].motor_damping == pytest.approx(2.52e-5 * 160**2)
    assert actuators["ankle_pitch_1"].motor_damping == 1.181
    assert actuators.torque_limit[dofs.index("hip_yaw_1")] == 304
    assert actuators.stiffness[dofs.index("torso_yaw")] == 6000


def test_values_at_the_joint_are_kept(tmp_path):
    path = write(tmp_path, "arm: {actuators: {a: {type: SEA, Ks: 9, D: 1, B: 0.5, phi: 0.2, Torque_limit: 3}}}")
    actuators = Actuators.from_file(path, "arm", ("a", "b"))
    assert actuators["a"] == SeriesElastic(9, 1, 0.5, 0.2, 3)
    assert_allclose(actuators.motor_inertia, (0.2, 0))


def test_table_follows_the_order_of_the_robot():
    actuators = Actuators(("a", "b", "c"), {"c": SPRING, "a": SPRING})
    assert actuators.names == ("a", "c")
    assert_allclose(actuators.damping, (1, 0, 1))


def test_types_say_what_moves_each_joint(tmp_path):
    path = write(
        tmp_path,
        "arm: {actuators: {a: {type: SEA, Ks: 9, D: 1, B: 1, phi: 1, Torque_limit: 3}, b: {type: UNACTUATED}}}",
    )
    actuators = Actuators.from_file(path, "arm", ("a", "b", "c"))
    assert actuators.types == ("SEA", "UNACTUATED", "UNACTUATED") and actuators.passive == ("b", "c")
    assert actuators.driven.tolist() == [True, False, False] and actuators["b"] is None
    unknown = Actuators(("x", "a"), passive=("x",))
    assert unknown.types == ("UNACTUATED", "RIGID") and unknown.driven.tolist() == [False, True]
    assert Actuators(("x", "a"), passive=("x",)) == unknown != Actuators(("x", "a"))


def test_the_lower_limit_of_torque_counts(tmp_path):
    actuators = Actuators(("a", "b", "c"), {"a": SPRING, "c": SPRING})
    assert_allclose(actuators.bound((40.0, 50.0, 20.0)), (30.0, 50.0, 20.0))


def test_rotors_count_where_the_file_says_so(tmp_path):
    values = "type: SEA, Ks: 9, D: 1, B: 1, phim: 0.5, nu: 10, Torque_limit: 3"
    path = write(tmp_path, f"arm: {{actuators: {{a: {{{values}}}, b: {{{values}, reflect_inertia: true}}}}}}")
    actuators = Actuators.from_file(path, "arm", ("a", "b"))
    assert_allclose(actuators.motor_inertia, (50.0, 50.0))
    assert_allclose(actuators.reflected_inertia, (0.0, 50.0))


def test_unknown_joints_offer_the_nearest(tmp_path):
    with pytest.raises(UnknownName, match="unknown joint 'kne'"):
        Actuators(("knee",), {"kne": SPRING})
    with pytest.raises(UnknownName, match="unknown joint 'kne'"):
        Actuators(("knee",))["kne"]
    path = write(tmp_path, "leg:\n  actuators:\n    kne: {type: SEA, Ks: 9, D: 1, B: 1, phi: 1, Torque_limit: 3}\n")
    with pytest.raises(UnknownName, match=r"unknown joint 'kne'") as caught:
        Actuators.from_file(path, "leg", ("knee",))
    assert caught.value.names == ("knee",) and f"{path}:3:" in caught.value.where
    assert len(Actuators.from_file(path, "leg", ("knee",), elsewhere=("kne",))) == 0


@pytest.mark.parametrize(
    "values, what",
    [
        ("Ks: 9, D: 1, phi: 1, Torque_limit: 3", "either 'B' or 'Bm', got none"),
        ("Ks: 9, D: 1, B: 1, Bm: 1, nu: 2, phi: 1, Torque_limit: 3", "either 'B' or 'Bm', got B and Bm"),
        ("Ks: 9, D: 1, B: 1, phim: 1, Torque_limit: 3", "'phim' needs the ratio 'nu'"),
        ("Ks: -9, D: 1, B: 1, phi: 1, Torque_limit: 3", "Ks"),
        ("D: 1, B: 1, phi: 1, Torque_limit: 3", "key 'Ks' is missing"),
        ("Ks: 9, D: 1, B: 1, phi: 1", "key 'Torque_limit' is missing"),
        ("type: UNACTUATED, D: 1", "an UNACTUATED joint with 'D'"),
    ],
)
def test_incomplete_actuators_are_refused_with_their_place(tmp_path, values, what):
    path = write(
        tmp_path, f"leg:\n  actuators:\n    knee: {{{values if 'type' in values else f'type: SEA, {values}'}}}\n"
    )
    with pytest.raises(ConfigError) as caught:
        Actuators.from_file(path, "leg", ("knee",))
    assert what in str(caught.value) and f"{path}:3:" in str(caught.value)


def test_a_file_without_the_robot_is_refused(tmp_path):
    path = write(tmp_path, "leg: {actuators: {}}")
    with pytest.raises((ConfigError, UnknownName, SolferErrors), match="centauro"):
        Actuators.from_file(path, "centauro", ("knee",))
