"""What sensors see of a simulation: read-only, live, and independent of who else looks."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.needs import pybullet_robot

from solfer.errors import UnknownName
from solfer.model import Kinematics
from solfer.simulation import Rates, Simulation, read_bundle
from solfer.simulation.sensors import SensorsRecord
from solfer.simulation.sensors.records import KINDS
from solfer.transport.messages import JointMessage

ROBOT = Path(__file__).resolve().parents[3] / "config/robots/centauro/robot.yaml"
HAND = "lbr_iiwa_link_7"


@pytest.fixture(scope="module")
def arm():
    """Make an arm swing that has an inertial sensor at its hand."""
    bundle = read_bundle(pybullet_robot("kuka_iiwa/model.urdf"))
    sensors = SensorsRecord.model_validate({"imu": {"link": HAND}})
    simulation = Simulation.from_file(bundle.model_copy(update={"sensors": sensors}))
    effort = np.array([5.0, -60.0, 10.0, 20.0, 1.0, 2.0, 0.1])
    simulation.lower_level.accept("position_controller", JointMessage(simulation.body.joints, effort=effort))
    for _ in range(20):
        simulation.step()
    yield simulation
    simulation.close()


def at(simulation, q, v):
    """Kinematics of the arm at a position and a velocity."""
    kinematics = Kinematics(simulation.kinematics.description, False)
    kinematics.update(q, v)
    return kinematics


def test_sensors_cannot_write_the_state(arm):
    now, before = arm.state.now, arm.state.before
    for numbers in (now.q, now.v, now.torque, before.q, before.v, before.torque, now.gravity, now.position(HAND)):
        with pytest.raises(ValueError, match="read-only"):
            numbers[:] = 0.0
    with pytest.raises(AttributeError):
        arm.state.now = before


def test_samples_share_nothing_with_the_state(arm):
    truth = (arm.q, arm.v, arm.torque, arm.body.position, arm.body.orientation)
    for sensor in arm.sensors.values():
        for message in sensor.messages():
            arrays = [value for value in vars(message).values() if isinstance(value, np.ndarray)]
            assert arrays and not any(np.shares_memory(array, true) for array in arrays for true in truth)


def test_moments_follow_each_step(arm):
    for _ in range(3):
        arm.step()
        moments = ((arm.state.now, arm.q, arm.v), (arm.state.before, arm.q_before, arm.v_before))
        for moment, q, v in moments:
            expected = at(arm, q, v)
            np.testing.assert_array_equal(moment.position(HAND), expected.position(HAND))
            np.testing.assert_array_equal(moment.rotation(HAND), expected.rotation(HAND))
            np.testing.assert_array_equal(moment.velocity(HAND), expected.velocity(HAND))
        assert np.abs(arm.state.now.position(HAND) - arm.state.before.position(HAND)).max() > 1e-5


def test_nobody_else_changes_a_measurement(arm):
    sample = arm.sensors["imu"].measure()
    first = sample.orientation.copy(), sample.angular.copy(), sample.acceleration.copy()
    arm.kinematics.update(np.ones(7))
    arm.state.before.velocity(HAND)
    sample = arm.sensors["imu"].measure()
    for number, expected in zip((sample.orientation, sample.angular, sample.acceleration), first, strict=True):
        np.testing.assert_array_equal(number, expected)


def test_links_are_checked_by_name(arm):
    with pytest.raises(UnknownName, match=HAND):
        arm.state.now.require(HAND + "7")


def test_each_kind_has_its_rate():
    names = [kind.name for kind in KINDS]
    assert sorted(Rates.model_fields) == sorted(names) == names
    assert {"base", "contacts", "imu", "joints", "motors"} <= set(names)


@pytest.mark.slow
def test_a_base_is_where_it_was_put_to_the_last_digits():
    """PyBullet's own functions of transforms have the precision of single numbers."""
    rng = np.random.default_rng(4)
    with closing(Simulation.from_file(ROBOT)) as simulation:
        body, q, v = simulation.body, np.zeros_like(simulation.q), np.zeros_like(simulation.v)
        for _ in range(5):
            position = rng.uniform(-3.0, 3.0, 3)
            orientation = Rotation.random(random_state=rng)
            body.place(np.zeros(len(body.joints)), position, orientation.as_quat())
            body.read(q, v, np.zeros(len(body._motors.rows)))
            np.testing.assert_allclose(body.position, position, atol=1e-14)
            np.testing.assert_allclose(
                Rotation.from_quat(body.orientation).as_matrix(), orientation.as_matrix(), atol=1e-14
            )
