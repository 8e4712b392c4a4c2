"""Errors of real sensors on a simulated robot: encoders, torque sensors, and an IMU that knows only its own samples."""

import numpy as np
import pinocchio as pin
import pytest
from support.needs import pybullet_robot

from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation, read_bundle
from solfer.simulation.sensors import SensorsRecord
from solfer.simulation.sensors.kinds.imu import ImuRecord

HAND, JOINTS = "lbr_iiwa_link_7", 7
RESOLUTION = 2.0 * np.pi / 2**16  # [rad]


@pytest.fixture
def make():
    """Make arms with the sensors of records."""
    made = []

    def build(**sensors):
        bundle = read_bundle(pybullet_robot("kuka_iiwa/model.urdf"))
        record = SensorsRecord.model_validate(sensors)
        made.append(Simulation.from_file(bundle.model_copy(update={"sensors": record})))
        return made[-1]

    yield build
    for simulation in made:
        simulation.close()


def joints(simulation, samples=1):
    """Take samples of the joints' sensors; return positions and efforts, shape (samples, JOINTS) each."""
    messages = (simulation.sensors["joints"].measure() for _ in range(samples))
    taken = [(message.position.copy(), message.effort.copy()) for message in messages]
    return tuple(np.array(column) for column in zip(*taken, strict=True))


def test_encoders_have_their_resolution(make):
    arm = make(joint_noise={"resolution": RESOLUTION})
    arm.q[:] = np.linspace(-2.0, 2.0, JOINTS)
    ((position,), _) = joints(arm)
    np.testing.assert_allclose(position / RESOLUTION, np.round(position / RESOLUTION), atol=1e-9)
    assert 0.0 < np.abs(position - arm.q).max() <= 0.5 * RESOLUTION + 1e-12


def test_torque_sensors_have_an_offset_by_seed(make):
    arm = make(joint_noise={"effort": 0.5, "effort_offset": 2.0})
    _, efforts = joints(arm, 2000)
    offsets = efforts.mean(axis=0) - arm.torque
    assert np.abs(offsets).max() <= 2.05 and offsets.std() > 0.5
    np.testing.assert_allclose(efforts.std(axis=0), 0.5, rtol=0.08)
    arm.reset(seed=5)
    assert np.abs(joints(arm, 500)[1].mean(axis=0) - arm.torque - offsets).max() > 0.5
    arm.reset()
    np.testing.assert_array_equal(joints(arm, 2000)[1], efforts)


IMU = {
    "link": HAND,
    "gyroscope": {"density": 1e-4, "bias": 0.01, "walk": 1e-4},
    "accelerometer": {"density": 1e-3, "bias": 0.02},
    "attitude": {"time_constant": 1.0, "bias_time": 3.0},
}


def samples(simulation, steps):
    """Step, and return each second step's angular velocity, specific force and orientation, side by side."""
    taken = []
    for step in range(steps):
        simulation.step()
        if step % 2:
            message = simulation.sensors["imu"].measure()
            taken.append(np.concatenate((message.angular, message.acceleration, message.orientation)))
    return np.array(taken)


def test_an_imu_at_rest_drifts_about_the_vertical(make):
    arm, true = make(imu=IMU), make(imu={"link": HAND})
    taken, truth = samples(arm, 1000), samples(true, 1000)
    error = (taken - truth)[:, :6]
    np.testing.assert_allclose(error[:, :3].std(axis=0), 1e-4 * np.sqrt(500.0), rtol=0.15)
    np.testing.assert_allclose(error[:, 3:].std(axis=0), 1e-3 * np.sqrt(500.0), rtol=0.15)
    bias = error.mean(axis=0)
    assert np.abs(bias[:3]).max() > 1e-3 and np.abs(bias[3:]).max() > 2e-3
    turned = rotation_from_quaternion(taken[-1, 6:]) @ rotation_from_quaternion(truth[-1, 6:]).T
    assert 1e-3 < np.linalg.norm(pin.log3(turned)) < 0.1  # the orientation is not the truth, and near it
    arm.reset()
    np.testing.assert_array_equal(samples(arm, 100), taken[:50])


def test_an_exact_record_leaves_errors_out(make):
    noisy = {"effort": 0.5, "effort_offset": 2.0, "resolution": RESOLUTION}
    arm = make(imu={**IMU, "exact": True}, joint_noise={**noisy, "exact": True})
    true = make(imu={"link": HAND})
    np.testing.assert_array_equal(samples(arm, 20), samples(true, 20))
    np.testing.assert_array_equal(joints(arm), joints(true))


def test_messages_tell_the_noise_of_a_sample(make):
    arm = make(imu=IMU, rates={"imu": 500})
    assert arm.sensors["imu"].measure().deviations == pytest.approx((0.0, 1e-4 * 500**0.5, 1e-3 * 500**0.5))
    for _ in range(5):  # at another rate than configured, as an argument of the simulator has it
        arm.step()
    assert arm.sensors["imu"].measure().deviations == pytest.approx((0.0, 1e-4 * 200**0.5, 1e-3 * 200**0.5))


def test_biases_do_not_walk_in_a_pause(make):
    arm = make(imu=IMU | {"gyroscope": {"bias": 0.01, "walk": 1.0}})
    arm.step()
    first = arm.sensors["imu"].measure().angular.copy()
    np.testing.assert_array_equal(arm.sensors["imu"].measure().angular, first)
    arm.step()
    assert np.abs(arm.sensors["imu"].measure().angular - first).max() > 1e-3


def test_centauro_is_shipped_with_real_sensors(repository):
    sensors = read_bundle(repository / "config/robots/centauro/robot.yaml").sensors
    assert not sensors.joint_noise.exact and sensors.joint_noise.effort_offset == 2.0
    assert sensors.imu.effective() == sensors.imu != ImuRecord(link="imu_link")
    assert (sensors.rates.imu, sensors.rates.joints, sensors.delay) == (500.0, 200.0, 0.002)
    perfect = sensors.perfect()
    assert perfect.joint_noise.exact and perfect.imu.effective() == ImuRecord(link="imu_link")
    assert perfect.delay == 0.0 and perfect.rates == sensors.rates
