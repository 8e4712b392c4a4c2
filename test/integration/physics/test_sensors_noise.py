"""Noise and bias of CENTAURO's sensors, and what the server publishes of them."""

import dataclasses

import numpy as np
import pytest

from solfer.errors import SimulationError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Rates, Simulation, SimulationServer
from solfer.simulation.bundle import load_bundle
from solfer.simulation.sensors import SensorsRecord

NOISE = {
    "joint_noise": {"position": 1e-4, "velocity": 0.01, "effort": 0.5},
    "imu": {
        "link": "imu_link",
        "noise": {"orientation": 0.002, "angular": 0.01, "acceleration": 0.05},
        "bias": {"angular": (0.1, 0.0, -0.2), "acceleration": (0.0, 0.3, 0.0)},
    },
}
SAMPLES = 3000


@pytest.fixture
def make(repository):
    """Make simulations of CENTAURO with the sensors of records."""
    made = []

    def build(**sensors) -> Simulation:
        bundle = load_bundle(repository / "config/robots/centauro/robot.yaml")
        equipment = dataclasses.replace(bundle.equipment, record=SensorsRecord.model_validate(sensors))
        made.append(Simulation(dataclasses.replace(bundle, equipment=equipment)))
        return made[-1]

    yield build
    for simulation in made:
        simulation.close()


def samples(simulation, steps=50):
    """Return the bytes of what all noisy sensors measure in some steps."""
    published = b""
    for _ in range(steps):
        simulation.step()
        imu, joints = simulation.sensors["imu"].measure(), simulation.sensors["joints"].measure()
        published += b"".join(
            array.tobytes()
            for array in (
                imu.orientation,
                imu.angular,
                imu.acceleration,
                joints.position,
                joints.velocity,
                joints.effort,
            )
        )
    return published


def test_equal_seeds_give_bitwise_equal_samples(make):
    first, second, other = make(**NOISE), make(**NOISE), make(seed=1, **NOISE)
    published = samples(first)
    assert samples(second) == published
    assert samples(other) != published
    first.reset()
    assert samples(first) == published


def test_noise_does_not_touch_the_motion(make):
    noisy, exact = make(**NOISE), make()
    for _ in range(100):
        noisy.step()
        noisy.sensors["joints"].measure()
        exact.step()
    assert noisy.q.tobytes() == exact.q.tobytes()


def test_noise_has_the_records_deviation_and_bias(make):
    """Mean and deviation of the IMU's errors against a sensor without noise, within what that many samples allow."""
    simulation, exact = make(**NOISE), make(imu={"link": "imu_link"})
    for world in (simulation, exact):
        for _ in range(10):
            world.step()
    truth, columns = exact.sensors["imu"].measure(), []
    for _ in range(SAMPLES):
        imu = simulation.sensors["imu"].measure()
        turn = rotation_from_quaternion(truth.orientation).T @ rotation_from_quaternion(imu.orientation)
        columns.append(
            [imu.angular - truth.angular, imu.acceleration - truth.acceleration, [turn[2, 1], turn[0, 2], turn[1, 0]]]
        )
    for index, (deviation, bias) in enumerate(((0.01, (0.1, 0.0, -0.2)), (0.05, (0.0, 0.3, 0.0)), (0.002, (0, 0, 0)))):
        error = np.array([column[index] for column in columns])
        np.testing.assert_allclose(error.std(axis=0), deviation, rtol=0.06)
        np.testing.assert_allclose(error.mean(axis=0), bias, atol=5.0 * deviation / np.sqrt(SAMPLES))
    assert imu.deviations == (0.002, 0.01, 0.05)


def test_joint_noise_has_the_records_deviations(make):
    simulation = make(**NOISE)
    published = {field: [] for field in NOISE["joint_noise"]}
    for _ in range(200):
        message = simulation.sensors["joints"].measure()
        for field, values in published.items():
            values.append(getattr(message, field).copy())
    truth = {"position": simulation.q[6:], "velocity": simulation.v[6:], "effort": simulation.torque[6:]}
    for field, deviation in NOISE["joint_noise"].items():
        error = np.array(published[field]) - truth[field]
        assert error.std() == pytest.approx(deviation, rel=0.03)
        assert error.mean() == pytest.approx(0.0, abs=5.0 * deviation / np.sqrt(error.size))


def test_a_sensor_on_an_unknown_link_is_refused(make):
    with pytest.raises(UnknownName, match="imu_lnk") as failure:
        make(imu={"link": "imu_lnk"})
    assert failure.value.names[0] == "imu_link"


TOPICS = {
    "joint_states": ("sensor_msgs/JointState", 500.0),
    "motor_states": ("sensor_msgs/JointState", 200.0),
    "floating_base": ("nav_msgs/Odometry", 250.0),
    "imu": ("sensor_msgs/Imu", 1000.0),
    "contacts/front_left_leg": ("geometry_msgs/WrenchStamped", 100.0),
    "contacts/right_arm/link": ("geometry_msgs/WrenchStamped", 100.0),
}
RATES = {"joints": 500, "base": 250, "imu": 1000, "motors": 200, "contacts": 100}


def test_every_topic_has_rate_and_simulated_stamps(make):
    simulation, bus = make(imu={"link": "imu_link"}, rates=RATES), Bus()
    server, plugin = SimulationServer(simulation, MemoryMiddleware(bus, "robot")), MemoryMiddleware(bus, "plugin")
    queues = {topic: plugin.queue(topic, message, 1000) for topic, (message, _) in TOPICS.items()}
    bus.every(0.001, server.cycle)
    bus.run_until(0.2)
    for topic, (_, rate) in TOPICS.items():
        stamps = [message.stamp for message in queues[topic].drain()]
        np.testing.assert_allclose(stamps, np.arange(1, round(0.2 * rate) + 1) / rate, atol=1e-12)


@pytest.mark.parametrize("rate", ["imu", "motors", "contacts", "base"])
def test_each_rate_is_a_whole_number_of_steps(make, rate):
    simulation = make(imu={"link": "imu_link"})
    with pytest.raises(SimulationError, match="300 Hz is not a rate"):
        SimulationServer(simulation, MemoryMiddleware(Bus(), "robot"), Rates(**{rate: 300.0}))
