"""Parts of sensors that need no world: noise, names of messages, the files that sensors are made of."""

import numpy as np
import pytest

from solfer.config import read
from solfer.errors import ConfigError, SolferErrors, UnknownName
from solfer.model.contacts import read_contacts
from solfer.simulation.sensors.noise import Noise
from solfer.simulation.sensors.records import SensorsRecord
from solfer.transport import canonical

SAMPLES = 100_000


def sequence(seed: int, sensor: str, size: int = SAMPLES) -> np.ndarray:
    """Draw noise of standard deviation 2."""
    values = np.zeros(size)
    Noise(seed, sensor).add(values, 2.0)
    return values


def test_noise_is_white_and_gaussian():
    values = sequence(1, "imu")
    assert values.mean() == pytest.approx(0.0, abs=4.0 * 2.0 / np.sqrt(SAMPLES))
    assert values.std() == pytest.approx(2.0, rel=0.01)
    assert (np.abs(values) < 2.0).mean() == pytest.approx(0.6827, abs=0.01)
    assert np.corrcoef(values[1:], values[:-1])[0, 1] == pytest.approx(0.0, abs=0.02)


def test_equal_seeds_give_equal_noise_and_others_another():
    assert sequence(1, "imu").tobytes() == sequence(1, "imu").tobytes()
    for other in (sequence(2, "imu"), sequence(1, "joints")):
        assert np.corrcoef(sequence(1, "imu"), other)[0, 1] == pytest.approx(0.0, abs=0.02)


def test_noise_begins_anew_on_request():
    noise, first, second = Noise(3, "imu"), np.zeros(5), np.zeros(5)
    noise.add(first, 1.0)
    noise.restart()
    noise.add(second, 1.0)
    np.testing.assert_array_equal(first, second)


def test_no_deviation_changes_nothing():
    values = np.array([0.1, -0.0])
    Noise(1, "imu").add(values, 0.0)
    assert values.tobytes() == np.array([0.1, -0.0]).tobytes()


@pytest.mark.parametrize(
    "name, meant",
    [
        ("gazebo_msgs::LinkStates", "nav_msgs/Odometry"),
        ("gazebo_msgs::ContactsState", "geometry_msgs/WrenchStamped"),
        ("sensor_msgs::Imu", "sensor_msgs/Imu"),
        ("geometry_msgs/WrenchStamped", "geometry_msgs/WrenchStamped"),
    ],
)
def test_messages_have_names_of_the_original_too(name, meant):
    assert canonical(name) == meant


def test_an_unknown_message_names_the_nearest():
    with pytest.raises(UnknownName, match="sensor_msgs/Imus") as failure:
        canonical("sensor_msgs/Imus")
    assert "sensor_msgs/Imu" in failure.value.names


def test_contacts_of_the_robot(repository):
    contacts = read_contacts(repository / "config/robots/centauro/contacts.yaml", "centauro")
    assert [contact.name for contact in contacts][:2] == ["front_left_leg", "front_right_leg"]
    links = [contact.end_frame for contact in contacts]
    assert links == ["wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_7", "arm2_7"]
    wheel = contacts[1]
    assert (wheel.type, wheel.minor_axis, wheel.major_axis, wheel.reference_axis.z) == ("wheel", 0.068, 0.01, -1.0)
    assert wheel.constraint_matrix.force_3 == (0, 0, 0, 0, 0, 1)


@pytest.mark.parametrize(
    "line, place",
    [
        ("imu: {link: 3}", ":1:13"),
        ("imu: {noise: {angular: 0.1}}", ":1:1"),
        ("joint_noise: {position: -0.1}", ":1:25"),
        ("imu: {link: a, bias: {angular: [1.0, 2.0]}}", ":1:32"),
        ("rate: {imu: 200}", ":1:1"),
    ],
)
def test_mistakes_in_a_record_have_their_place(tmp_path, line, place):
    file = tmp_path / "sensors.yaml"
    file.write_text(line + "\n")
    with pytest.raises((ConfigError, UnknownName, SolferErrors)) as failure:
        read(file, SensorsRecord)
    assert f"sensors.yaml{place}" in str(failure.value)
