"""`odometry` as a whole plugin with `method: filter`: gaps, numbers that are none, and time that goes back."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.estimation import part

from solfer.transport.messages import ImuMessage, JointMessage

baseline, methods, log = (part(f"estimation_cases.{name}") for name in ("baseline", "methods", "log"))
PERIOD, SPEED, RADIUS = 0.005, 0.3, 0.078
SIDES = np.array((1.0, -1.0, 1.0, -1.0))


class Rolling:
    """The plugin, and CENTAURO that rolls straight on, by the messages of its sensors."""

    def __init__(self, folder, method="filter", count=lambda angles: angles):
        self._driver = count
        body = baseline.WheeledBody(log.ROBOT / "contacts.yaml")
        robot = body._robot
        indices, values = robot.named_state("mammal_wide_straight")
        robot.state.position[indices] = values
        self._names, self._position = robot.dofs[6:], robot.state.position[6:].copy()
        self._wheels = [robot.dof(f"j_wheel_{leg}") - 6 for leg in (1, 2, 3, 4)]
        self._turn, self.time, self._count = body.to_imu, 0.0, 0
        self._plugins = methods.Plugins(folder, (method,), np.full(4, RADIUS), 1.0)
        self._send(self._sample(), ("joints", "imu"))
        self.plugin = methods.plugin_on(self._plugins._bus, self._plugins._file, f"odometry_{method}")

    def _send(self, sample, sensors):
        self._plugins._bus.time = self.time
        for name in sensors:
            getattr(self._plugins, f"_{name}").write(getattr(sample, name))

    def _sample(self):
        """Measure; the numbers differ a little in each sample, as they do."""
        self._count += 1
        velocity = np.zeros(len(self._names))
        velocity[self._wheels] = SIDES * SPEED / RADIUS
        angle = 0.5 * math.acos(np.clip(0.5 * (np.trace(self._turn) - 1.0), -1.0, 1.0))
        axis = np.array([self._turn[i, j] - self._turn[j, i] for i, j in ((2, 1), (0, 2), (1, 0))])
        axis = axis / max(np.linalg.norm(axis), 1e-12)
        imu = ImuMessage("imu_link", np.append(math.sin(angle) * axis, math.cos(angle)))
        imu.angular[:] = 1e-9 * (self._count % 2)
        imu.stamp = 1.0 + self.time
        position = self._position.copy()
        position[self._wheels] = self._driver(position[self._wheels])
        joints = JointMessage(self._names, position, velocity, np.zeros(len(self._names)), stamp=1.0 + self.time)
        return SimpleNamespace(time=self.time, joints=joints, imu=imu)

    def roll(self, duration, spoil=lambda sample: None, sensors=("joints", "imu")):
        """Roll for a time [s], in which only some sensors send, what a function has changed."""
        for _ in range(round(duration / PERIOD)):
            self.time += PERIOD
            self._position[self._wheels] += SIDES * SPEED / RADIUS * PERIOD
            sample = self._sample()
            spoil(sample)
            self._send(sample, sensors)
            self.plugin.cycle()

    @property
    def way(self):
        return float(self.plugin.component.law.position[0])


@pytest.fixture
def rolling(tmp_path):
    made = Rolling(tmp_path)
    made.roll(0.5)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("sensors", [("joints",), ("imu",), ()])
def test_half_a_second_of_silence_is_bridged(rolling, sensors):
    before = rolling.way
    rolling.roll(0.49, sensors=sensors)
    rolling.roll(0.5)
    assert rolling.plugin.running
    assert rolling.way - before == pytest.approx(0.99 * SPEED, abs=0.01)


@pytest.mark.parametrize("method", ["filter", "geometric"])
def test_a_robot_that_begins_anew_stays_where_it_was(tmp_path, method):
    """After a longer silence wheels count from elsewhere, and legs are bent in another way."""
    rolling = Rolling(tmp_path, method)
    rolling.roll(0.5)
    before = rolling.plugin.component.law.position.copy()
    rolling.roll(1.5, sensors=())
    legs = np.ones(len(rolling._position), dtype=bool)
    legs[rolling._wheels] = False
    drawn = np.random.default_rng(3)
    rolling._position[legs] += drawn.uniform(-0.2, 0.2, legs.sum())
    rolling._position[rolling._wheels] = drawn.uniform(-3.0, 3.0, 4)
    for _ in range(100):
        rolling.roll(PERIOD)
        x, y, _, *tilt = rolling.plugin.robot.command.position[:5]
        assert np.abs(tilt).max() < 0.02 and abs(y) < 0.05 and before[0] - 0.01 < x
    assert x - before[0] == pytest.approx(0.5 * SPEED, abs=0.05)


def nan_joint(sample):
    sample.joints.position[3] = math.nan


def nan_rate(sample):
    sample.imu.angular[2] = math.nan


def no_turn(sample):
    sample.imu.orientation[:] = 0.0


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [nan_joint, nan_rate, no_turn])
def test_what_is_no_number_is_refused(rolling, spoil):
    before = rolling.way
    rolling.roll(0.1, spoil)
    rolling.roll(0.5)
    law, component = rolling.plugin.component.law, rolling.plugin.component
    assert rolling.way - before == pytest.approx(0.6 * SPEED, abs=0.01)
    assert np.isfinite(law.kalman.covariance).all() and np.isfinite(component.model.command.position).all()
    assert np.abs(component.model.state.position[3:6]).max() < 0.01


@pytest.mark.slow
def test_an_imu_that_turns_on_its_link_is_refused_until_it_and_legs_rest(rolling, caplog):
    """All that it measures agrees, but the ground would turn below wheels: encoders that drift would do it, too."""
    begin = rolling.time
    component = rolling.plugin.component
    joints = [rolling._names.index(name) for name in component.model.dofs[6:]]

    def turn(sample):
        wheels = component.law._motion.wheels
        sample.joints.effort[joints] = -250.0 * wheels.jacobian[2::3].sum(axis=0)
        passed = rolling.time - begin
        angle = 0.2 * passed if passed < 2.5 else 0.0
        orientation = Rotation.from_quat(sample.imu.orientation) * Rotation.from_rotvec((angle, 0.0, 0.0))
        sample.imu.orientation[:] = orientation.as_quat()
        sample.imu.angular[0] += 0.2 * (passed < 2.5)
        sample.imu.acceleration[:] = orientation.inv().apply((0.0, 0.0, 9.81))
        sample.joints.position[knee] -= 0.1 * min(max(passed - 1.6, 0.0), 2.0)
        sample.joints.velocity[knee] -= 0.1 * (1.6 < passed < 3.6)

    knee = rolling._names.index("knee_pitch_1")
    rolling.roll(1.6, turn)
    assert not rolling.plugin.running and "which refuses messages" in rolling.plugin.health()[1]
    (refusal,) = [text for text in caplog.messages if text.startswith("feedback 'imu_base' refuses")]
    assert "the ground turns by 0.05" in refusal
    rolling.roll(2.0, turn)
    assert not rolling.plugin.running
    rolling.roll(1.6, turn)
    assert rolling.plugin.running


def accelerated(rolling, ahead):
    """Return what lets the IMU measure an acceleration of the base [m/s^2]."""
    force = rolling._turn.T @ (ahead, 0.0, 9.81)

    def measure(sample):
        sample.imu.acceleration[:] = force

    return measure


def test_wheels_that_all_spin_move_the_base_as_the_accelerometer_says(rolling, caplog):
    """The robot runs against something within 0.2 s, its wheels go on for 3 s, and it comes free again."""
    law = rolling.plugin.component.law
    rolling.roll(1.0, accelerated(rolling, 0.0))
    before = rolling.way
    rolling.roll(0.2, accelerated(rolling, -5.0 * SPEED))
    rolling.roll(0.1, accelerated(rolling, 0.0))
    assert law.slip.lasts and "all wheels slip by" in caplog.text and law.velocity[0] == pytest.approx(0.0, abs=0.01)
    assert rolling.plugin.component.wheel_states().status[0].level == 1
    rolling.roll(2.7, accelerated(rolling, 0.0))
    missed = rolling.way - before - 0.1 * SPEED
    assert abs(missed) < min(0.03, math.sqrt(law.kalman.covariance[0, 0])) and abs(law.velocity[0]) < 0.01
    rolling.roll(0.2, accelerated(rolling, 5.0 * SPEED))
    rolling.roll(1.0, accelerated(rolling, 0.0))
    assert not law.slip.lasts and law.velocity[0] == pytest.approx(SPEED, abs=1e-3)
    assert rolling.way - before == pytest.approx(1.2 * SPEED, abs=0.05)


@pytest.mark.parametrize("acceleration", [0.5, -5.0])
def test_an_accelerometer_that_no_slip_explains_moves_nothing(rolling, caplog, acceleration):
    rolling.roll(1.0, accelerated(rolling, 0.0))
    before = rolling.way
    rolling.roll(2.0, accelerated(rolling, acceleration))
    assert "wheels slide, or the accelerometer is wrong" in caplog.text
    assert rolling.way - before == pytest.approx(2.0 * SPEED, abs=0.1)


@pytest.mark.parametrize("rate", [0.2, -0.2])
def test_a_gyroscope_that_jumps_is_no_slip(rolling, caplog, rate):
    """Wheels seem to spin up within a period, since the base is far above them."""
    law = rolling.plugin.component.law
    rolling.roll(1.0, accelerated(rolling, 0.0))

    def jump(sample):
        accelerated(rolling, 0.0)(sample)
        sample.imu.angular[1] += rate

    for _ in range(20):
        rolling.roll(0.02, jump)
        rolling.roll(0.1, accelerated(rolling, 0.0))
        assert not law.slip.lasts
    assert "all wheels slip" not in caplog.text and "the accelerometer is wrong" in caplog.text


def test_time_that_goes_back_begins_anew(rolling):
    assert rolling.way > 0.1
    bus = rolling._plugins._bus
    bus.publish_time(5.0)
    rolling.roll(PERIOD)
    bus.publish_time(0.0)
    rolling.roll(0.2)
    assert rolling.plugin.running and 0.0 <= rolling.way < 0.2 * SPEED + 0.01


def test_joints_that_lose_their_stamps_count_by_their_arrival(rolling):
    """Those of the IMU count, so that both are of one time."""
    before, streams = rolling.way, rolling.plugin.component.streams
    assert streams.synchronizes

    def forget(sample):
        sample.joints.stamp = 0.0

    rolling.roll(0.3, forget)
    assert rolling.way - before == pytest.approx(0.3 * SPEED, abs=2.0 * PERIOD * SPEED)
    rolling.roll(0.3)
    assert rolling.way - before == pytest.approx(0.6 * SPEED, abs=0.01)


def within(angles):
    """Count angles in [-pi, pi)."""
    return (angles + math.pi) % math.tau - math.pi


def anywhere(angles):
    """Begin each wheel on a turn of its own."""
    return angles + math.tau * np.random.default_rng(5).integers(-50, 50, 4)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["filter", "geometric"])
def test_the_count_of_the_wheels_does_not_matter(tmp_path, method):
    """Each wheel turns by more than a turn; estimates agree to 1e-9."""
    ways = []
    for name, count in (("on", lambda angles: angles), ("within", within), ("anywhere", anywhere)):
        (tmp_path / name).mkdir()
        made = Rolling(tmp_path / name, method, count)
        made.roll(2.0)
        ways.append(np.concatenate((made.plugin.component.law.position, made.plugin.robot.command.position[:6])))
        assert made.plugin.running and made.way == pytest.approx(2.0 * SPEED, abs=0.02)
    np.testing.assert_allclose(ways[1:], ways[:1] * 2, atol=1e-9)
