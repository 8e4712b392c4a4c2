"""Robots in worlds from YAML: where they begin, what pushes them, and that all of it repeats itself."""

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solfer.errors import ModelError, SimulationError, UnknownName
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation
from solfer.simulation.robot_body.placement import StartPlacement
from solfer.simulation.world.records import ENGINES

CONFIG = Path(__file__).resolve().parents[3] / "config"
ROBOT, WORLDS = CONFIG / "robots/centauro/robot.yaml", CONFIG / "worlds"
WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
SLOPE = np.radians(5.0)


def simulated(world: str) -> Simulation:
    """CENTAURO in a world of this package."""
    return Simulation.from_file(ROBOT, world=WORLDS / f"{world}.yaml")


@pytest.fixture(scope="module")
def flat():
    """CENTAURO on a plane."""
    simulation = simulated("flat")
    yield simulation
    simulation.close()


@pytest.fixture(scope="module")
def boxes():
    """CENTAURO among boxes."""
    simulation = simulated("boxes")
    yield simulation
    simulation.close()


def run(simulation: Simulation, duration: float) -> None:
    """Let simulated time pass [s]."""
    for _ in range(round(1000 * duration)):
        simulation.step()


def fingerprint(simulation: Simulation) -> str:
    """Hash of a fall onto a crate with a push, the crate included."""
    digest = hashlib.sha256()
    simulation.reset(placement=StartPlacement(0.9, 0.4, 0.3, 0.02), seed=3)
    simulation.pushes.add("torso_2", (150.0, 40.0, 0.0), (0.0, 5.0, 0.0), 0.3)
    for _ in range(800):
        simulation.step()
        digest.update(simulation.q.tobytes() + simulation.v.tobytes() + simulation.torque.tobytes())
        digest.update(b"".join(part.tobytes() for pose in simulation.world.poses() for part in pose))
    return digest.hexdigest()


@pytest.mark.soak
def test_equal_inputs_give_bitwise_equal_motions(boxes):
    first = fingerprint(boxes)
    assert fingerprint(boxes) == first
    run(boxes, 0.3)
    time = boxes.time
    boxes.reset("mammal_wide_high")
    assert boxes.time == time  # it goes on
    run(boxes, 0.2)
    assert fingerprint(boxes) == first
    other = subprocess.run([sys.executable, __file__], capture_output=True, text=True, check=True)
    assert other.stdout == first + "\n"


def test_a_push_adds_force_times_time(flat):
    flat.reset(placement=StartPlacement(height=3.0))
    kinematics = flat.kinematics

    def momentum() -> np.ndarray:
        kinematics.update(flat.q, flat.v)
        return kinematics.mass * (kinematics.center_of_mass_jacobian @ flat.v)

    force, duration = np.array([100.0, -60.0, 30.0]), 0.1
    flat.pushes.add("torso_2", force, (0.0, 0.0, 0.0), duration)
    run(flat, 0.2)
    weight = kinematics.mass * kinematics.gravity
    np.testing.assert_allclose(momentum(), duration * force + 0.2 * weight, atol=0.1)  # [Ns], of 186


def test_a_torque_turns_about_its_world_axis(flat):
    for axis in range(3):
        flat.reset(placement=StartPlacement(yaw=1.2, height=3.0))
        torque = np.zeros(3)
        torque[axis] = 50.0
        flat.pushes.add("pelvis", (0.0, 0.0, 0.0), torque, 0.02)
        run(flat, 0.02)
        spin = flat.body.angular
        assert np.argmax(np.abs(spin)) == axis and spin[axis] > 0.0


def test_it_comes_back_after_a_push(flat):
    flat.reset()
    run(flat, 1.0)
    before = flat.q[:6].copy()
    flat.pushes.add("pelvis", (0.0, 150.0, 0.0), (0.0, 0.0, 0.0), 0.3)
    run(flat, 0.15)
    assert np.abs(flat.q[:6] - before).max() > 2e-3  # it gave way
    run(flat, 2.85)
    assert np.abs(flat.q[3:6] - before[3:]).max() < 0.01 and abs(flat.q[2] - before[2]) < 2e-3
    assert np.linalg.norm(flat.q[:2] - before[:2]) < 0.02
    assert np.abs(flat.v).max() < 1e-2
    assert flat.contact_links() == WHEELS


def test_it_stands_after_a_drop(flat):
    flat.reset()
    touching = flat.body.position[2]
    flat.reset(placement=StartPlacement(height=0.05))
    assert flat.body.position[2] - touching == pytest.approx(0.05, abs=2e-5)
    assert flat.contact_links() == ()
    run(flat, 3.0)
    assert flat.contact_links() == WHEELS
    assert np.abs(flat.v).max() < 1e-2
    assert flat.body.position[2] == pytest.approx(touching, abs=0.01)


@pytest.mark.soak
def test_it_stands_on_a_slope():
    """The base is normal to the ground, nothing slides for 3 s, and the contact forces sum up to the weight."""
    simulation = simulated("slope")
    normal = np.array([-np.sin(SLOPE), 0.0, np.cos(SLOPE)])
    kinematics = simulation.kinematics
    kinematics.update(simulation.q)
    np.testing.assert_allclose(kinematics.rotation("pelvis")[:, 2], normal, atol=1e-6)
    start = simulation.body.position.copy()
    run(simulation, 1.0)
    assert simulation.contact_links() == WHEELS
    begin, joints = simulation.body.position.copy(), simulation.q[6:].copy()
    run(simulation, 2.0)
    assert simulation.contact_links() == WHEELS
    assert np.linalg.norm(simulation.body.position - begin) < 1e-3
    assert np.linalg.norm(simulation.body.position - start) < 0.02
    assert np.abs(simulation.q[6:] - joints).max() < 2e-3
    force = sum(simulation.contacts().values())
    weight = kinematics.mass * 9.81
    np.testing.assert_allclose(force, [0.0, 0.0, weight], atol=1.0)  # normal and friction together
    simulation.close()


def test_it_is_put_on_what_is_under_it():
    simulation = simulated("steps")
    ground = simulation.body.position[2]
    for x, height in ((0.0, 0.0), (3.5, 0.2)):
        simulation.reset(placement=StartPlacement(x=x))
        assert simulation.body.position[0] == pytest.approx(x, abs=1e-6)
        assert simulation.body.position[2] - ground == pytest.approx(height, abs=2e-5)
    simulation.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_it_stands_on_uneven_ground(engine):
    """It begins upright at its first contact, and settles on four wheels that carry its weight."""
    simulation = Simulation.from_file(ROBOT, world=WORLDS / "uneven.yaml", engine=engine)
    begin = simulation.body.position[2]
    run(simulation, 1.0)
    assert simulation.contact_links() == WHEELS
    assert 0.0 < begin - simulation.body.position[2] < 0.05
    upright = rotation_from_quaternion(simulation.body.orientation)[2, 2]
    assert np.degrees(np.arccos(upright)) < 5.0
    weight = simulation.kinematics.mass * 9.81
    np.testing.assert_allclose(sum(simulation.contacts().values()), [0.0, 0.0, weight], atol=0.03 * weight)
    simulation.close()


def test_boxes_with_mass_fall_and_fixed_ones_stay(boxes):
    boxes.reset(placement=StartPlacement(x=-2.0))
    before = boxes.world.poses()
    assert len(before) == 2
    boxes.world.place([(position + [0.0, 0.0, 0.3], orientation) for position, orientation in before])
    run(boxes, 1.0)
    for (old, _), (new, _) in zip(before, boxes.world.poses(), strict=True):
        np.testing.assert_allclose(new, old, atol=5e-3)
    boxes.reset()
    np.testing.assert_array_equal(boxes.world.poses()[0][0], before[0][0])


def test_without_friction_it_slides_down_the_slope():
    simulation = simulated("slope")
    run(simulation, 0.5)
    simulation.set_friction("ground", 0.0)
    begin = simulation.body.position.copy()
    run(simulation, 0.5)
    moved = simulation.body.position - begin
    assert moved[0] == pytest.approx(-0.5 * 9.81 * np.sin(SLOPE) * np.cos(SLOPE) * 0.5**2, rel=0.1)
    simulation.close()


@pytest.mark.parametrize(
    ("name", "coefficient", "error"),
    [
        ("grond", 0.5, UnknownName),
        ("wheel_9", 0.5, UnknownName),
        ("ground", -0.1, SimulationError),
        ("wheels", float("nan"), SimulationError),
    ],
)
def test_wrong_frictions(flat, name, coefficient, error):
    with pytest.raises(error, match=name):
        flat.set_friction(name, coefficient)


def test_a_wrong_reset_changes_nothing(flat):
    flat.reset("mammal_wide_high")
    run(flat, 0.05)
    before = flat.q.copy()
    wrong = (
        {"state": "mammal_wid"},
        {"seed": -1},
        {"placement": StartPlacement(height=-0.1)},
        {"placement": StartPlacement(x=float("nan"))},
    )
    for arguments in wrong:
        with pytest.raises((UnknownName, ModelError, SimulationError)):
            flat.reset(**arguments)
    flat.body.read(flat.q, flat.v, np.zeros(4))
    np.testing.assert_array_equal(flat.q, before)


if __name__ == "__main__":
    print(fingerprint(simulated("boxes")))
