"""The IMU of the mock hardware: mounted otherwise than in the URDF, and corrected by the file of `system: HW`."""

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG, ROBOT, World, perfect
from support.simulation.hardware_plugin import configuration

from solfer.config import read
from solfer.errors import SimulationError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.plugins import PluginState
from solfer.simulation import Simulation
from solfer.simulation.mock_hardware.mock_hardware import MockHardware, mounted
from solfer.simulation.mock_hardware.records import HardwareRecord
from solfer.simulation.physics import STEP
from solfer.simulation.sensors.kinds.joints import JointNoiseRecord

MOCK = ROBOT / "hardware" / "mock.yaml"
PUSH = np.array([150.0, 200.0, 0.0]), np.array([60.0, -40.0, 50.0])  # [N], [Nm]


def entries(file, *keys):
    """Read the rotation from the sensor to its link and the sensor's place on the link [m] from a file."""
    found = yaml.safe_load(file.read_text())
    for key in keys:
        found = found[key]
    rotation = np.array([[found["offset_orientation"][row + column] for column in "xyz"] for row in "xyz"])
    return rotation, np.array([found["offset_position"][axis] for axis in "xyz"])


def lever(samples, place):
    """Acceleration of a point at `place` on the link against the link's origin, in world axes, after each step.

    From orientation and angular velocity at the link's frame alone: (w' x R' r - w x R r) / dt.
    """
    rotations = [rotation_from_quaternion(orientation) for orientation, _, _ in samples]
    speeds = [
        np.cross(rotation @ angular, rotation @ place)
        for rotation, (_, angular, _) in zip(rotations, samples, strict=True)
    ]
    return [(after - before) / STEP for before, after in zip(speeds[:-1], speeds[1:], strict=True)]


@pytest.fixture(scope="module")
def samples():
    """Orientation, angular velocity and specific force after each step, as simulated and as the mock has them.

    Both robots have the same gains, and therefore the same motion.
    """
    record = read(MOCK, HardwareRecord).model_copy(update={"gains": None, "joint_noise": JointNoiseRecord()})
    pair = [Simulation.from_file(perfect()), Simulation.from_file(mounted(record).with_perfect_sensors())]
    published = [[], []]
    for simulation in pair:
        simulation.pushes.add("pelvis", *PUSH, 0.1)
    for _ in range(200):
        for simulation, kept in zip(pair, published, strict=True):
            simulation.step()
            message = simulation.sensors["imu"].measure()
            kept.append((message.orientation.copy(), message.angular.copy(), message.acceleration.copy()))
    np.testing.assert_array_equal(pair[0].q, pair[1].q)
    for simulation in pair:
        simulation.close()
    assert max(np.abs(angular).max() for _, angular, _ in published[0]) > 0.05
    return published


def test_raw_samples_differ_by_exactly_the_mounting(samples):
    turn, place = entries(MOCK, "imu")
    plain, mock = samples
    assert np.abs(turn - np.eye(3)).max() > 0.5
    for (q, w, f), (raw_q, raw_w, raw_f), beside in zip(plain[1:], mock[1:], lever(plain, place), strict=True):
        rotation = rotation_from_quaternion(q)
        np.testing.assert_allclose(rotation_from_quaternion(raw_q), rotation @ turn, atol=1e-12)
        np.testing.assert_allclose(raw_w, turn.T @ w, atol=1e-12)
        np.testing.assert_allclose(raw_f, turn.T @ (f + rotation.T @ beside), atol=1e-8)
    assert max(np.abs(beside).max() for beside in lever(plain, place)) > 0.1


def test_the_numbers_of_the_calibration_undo_it(samples):
    turn, place = entries(CONFIG / "support" / "hardware.yaml", "mwoibn", "feedback", "imu_base")
    plain, mock = samples
    for (q, w, f), (raw_q, raw_w, raw_f), beside in zip(plain[1:], mock[1:], lever(plain, place), strict=True):
        rotation = rotation_from_quaternion(raw_q) @ turn.T
        np.testing.assert_allclose(rotation, rotation_from_quaternion(q), atol=1e-12)
        np.testing.assert_allclose(turn @ raw_w, w, atol=1e-12)
        np.testing.assert_allclose(turn @ raw_f - rotation.T @ beside, f, atol=1e-8)


class PerfectHardware(World):
    """CENTAURO as its hardware publishes it, with perfect sensors: only their mounting counts."""

    def offer(self, middleware):
        record = read(MOCK, HardwareRecord)
        simulation = Simulation.from_file(mounted(record).with_perfect_sensors())
        return simulation, MockHardware(simulation, record, middleware)


def inertial(tmp_path, system, change=lambda text: text):
    """Write the shipped configuration with the robot that receives the IMU; `change` may alter hardware.yaml."""
    file = configuration(tmp_path, system, change)
    file.write_text(file.read_text().replace("robot: joint_space", "robot: inertial"))
    return file


@pytest.mark.daily(1)
@pytest.mark.parametrize(("system", "kind"), [("SM", World), ("HW", PerfectHardware)])
def test_both_give_the_robot_one_orientation(request, tmp_path, system, kind):
    world = kind()
    request.addfinalizer(world.close)
    plugin = world.plugin("joint_states", inertial(tmp_path, system))
    world.run(0.5)
    assert plugin.life is PluginState.RUNNING
    world.simulation.pushes.add("pelvis", *PUSH, 0.1)
    world.run(0.1)
    assert np.abs(world.simulation.q[3:6]).max() > 0.002
    # what is received is up to 7 ms old: a period of the sensor and the delay of the hardware
    np.testing.assert_allclose(plugin.robot.state.position[3:6], world.simulation.q[3:6], atol=0.005)
    world.run(3.0)
    np.testing.assert_allclose(plugin.robot.state.position[3:6], world.simulation.q[3:6], atol=1e-4)
    np.testing.assert_allclose(plugin.robot.state.velocity[3:6], world.simulation.v[3:6], atol=2e-3)


def test_a_wrong_mounting_turns_the_robot(request, tmp_path):
    """The rotation of the IMU's mount is transposed in the file: the estimate must be visibly off, or it is unused."""
    world = PerfectHardware()
    request.addfinalizer(world.close)
    transposed = {
        "xy: 0.48": "xy: -0.8",
        "xz: -0.8": "xz: 0.48",
        "yx: -0.8": "yx: 0.48",
        "yz: 0.0": "yz: 0.64",
        "zx: 0.48": "zx: -0.8",
        "zy: 0.64": "zy: 0.0",
    }

    def change(text):
        for old, new in transposed.items():
            assert old in text
            text = text.replace(old, new)
        return text

    plugin = world.plugin("joint_states", inertial(tmp_path, "HW", change))
    world.run(0.5)
    assert np.abs(plugin.robot.state.position[3:6] - world.simulation.q[3:6]).max() > 0.5


def test_no_imu_is_mounted_without_one(tmp_path):
    robot = yaml.safe_load((ROBOT / "robot.yaml").read_text())
    del robot["sensors"]["imu"]
    for name in ("centauro.urdf", "centauro.srdf", "contacts.yaml", "actuators.yaml", "gains.yaml"):
        (tmp_path / name).symlink_to(ROBOT / name)
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(robot))
    mock = tmp_path / "mock.yaml"
    mock.write_text(MOCK.read_text().replace("../robot.yaml", "robot.yaml"))
    with pytest.raises(SimulationError, match="the robot has no IMU") as caught:
        MockHardware.from_file(mock, MemoryMiddleware(Bus(), "mock"))
    assert "mock.yaml:15:" in str(caught.value)
