"""Joints and IMU whose messages come late, out of order or not at all: each measurement has both at one time."""

import math

import numpy as np
import pytest
from support.robots import lower_body

from solfer.components.odometry.sensing.samples import SortedSamples
from solfer.components.odometry.sensing.samples_kernel import LONGEST_LAG
from solfer.components.odometry.sensing.stamps import StampCheck
from solfer.components.odometry.sensing.streams import LONGEST_EXTRAPOLATION, Streams
from solfer.model.history import History

CYCLE, JOINTS, IMU = 0.005, 0.005, 0.002
"""Periods of the cycle, and of the messages of joints and IMU [s]."""

SIZE = 64
CLOCK = 1.7e9
"""What a sender's clock is ahead of that of arrivals [s]: a wall clock, and a monotonic one."""


def heading(time):
    """Heading of the base [rad]: it turns to and fro, beyond half a turn."""
    return 3.0 + 0.8 * math.sin(2.0 * time)


def rate(time):
    """Rate of the heading [rad/s]."""
    return 1.6 * math.cos(2.0 * time)


class Sensors:
    """A robot whose first joint has the time as its position, with messages that arrive as a test says.

    Args:
        seed: Seed of what is drawn.
        late: Largest delay of joints and IMU [s].
        lost: Share of both that never arrives.
        behind: Time by which the IMU's clock is behind [s].

    Attributes:
        frozen: Time at which the numbers of the joints stay, whatever their stamps are [s].
    """

    frozen = math.inf

    def __init__(self, seed=1, late=(0.0, 0.0), lost=(0.0, 0.0), behind=0.0):
        self.robot, self.time = lower_body(), 0.0
        state, size = self.robot.state, self.robot.size
        self.joints = History(("position", "velocity"), np.arange(6, size)[::-1].copy(), SIZE)
        self.imu = History(("position", "velocity"), np.arange(3, 6), SIZE)
        state.histories += [self.joints, self.imu]
        self._random, self._late, self._lost, self._behind = np.random.default_rng(seed), late, lost, behind
        self._under_way, self._next = [[], []], [JOINTS, IMU]

    def cycle(self):
        """Let a cycle pass; what arrives in it stands in the histories, and the newest in the State."""
        self.time += CYCLE
        for which, (history, period) in enumerate(((self.joints, JOINTS), (self.imu, IMU))):
            in_progress, history.count = self._under_way[which], 0
            while self._next[which] <= self.time + 1e-9:
                stamp, self._next[which] = self._next[which], self._next[which] + period
                delay = self._random.uniform(0.0, self._late[which])
                if self._random.uniform() >= self._lost[which]:
                    in_progress.append((stamp + delay, stamp))
            for arrival, stamp in sorted(each for each in in_progress if each[0] <= self.time):
                history.add(CLOCK + stamp - which * self._behind, arrival, self.numbers(which, stamp))
            self._under_way[which] = [each for each in in_progress if each[0] > self.time]
            if history.count:
                newest = history.values[history.count - 1]
                self.robot.state.position[history.dofs], self.robot.state.velocity[history.dofs] = newest

    def numbers(self, which, time):
        """Return what joints (0) or the IMU (1) measure at a time [s], shape (2, k)."""
        if which:
            angle = math.remainder(heading(time), 2.0 * math.pi)
            return np.array(((0.0, 0.0, angle), (0.0, 0.0, rate(time))))
        position, velocity = np.zeros((2, self.robot.size - 6))
        # the first joint, in the reversed order of the history
        position[-1] = min(time, self.frozen)
        velocity[-1] = 1.0
        return np.stack((position, velocity))


def measurements(sensors, streams, duration):
    """Yield the time by the first joint [s] of each measurement, and what is said of it, over a duration [s]."""
    state = sensors.robot.state
    for _ in range(round(duration / CYCLE)):
        sensors.cycle()
        newest = state.position[6:].copy()
        streams.read(CYCLE)
        while streams.next():
            yield float(state.position[6]), streams.elapsed, streams.measured, state.position[5], state.velocity[5]
        streams.finish()
        np.testing.assert_array_equal(state.position[6:], newest)


@pytest.mark.parametrize(
    ("late", "lost", "close"),
    [
        ((0.0, 0.0), (0.0, 0.0), 3e-5),
        ((0.015, 0.0), (0.0, 0.0), 3e-5),
        ((0.0, 0.015), (0.0, 0.0), 1e-4),
        ((0.015, 0.015), (0.1, 0.1), 1e-4),
        ((0.0, 0.0), (0.0, 0.6), 1e-3),
    ],
)
def test_each_measurement_has_both_at_one_time(late, lost, close):
    """Whatever the transport does, orientation and joints are of one stamp, and their times add up."""
    sensors = Sensors(seed=3, late=late, lost=lost)
    streams = Streams(sensors.robot)
    sensors.cycle()
    streams.start()
    begin, passed, turned, count = sensors.robot.state.position[6], 0.0, None, 0
    for time, elapsed, measured, angle, speed in measurements(sensors, streams, 4.0):
        assert elapsed > 0.0 and (measured or turned is None)
        passed, before = passed + elapsed, time - elapsed
        count += 1
        if not measured:
            continue
        assert math.remainder(angle - heading(time), 2.0 * math.pi) == pytest.approx(0.0, abs=close)
        if turned is not None and elapsed < 0.02:
            assert speed == pytest.approx((heading(time) - heading(before)) / elapsed, abs=20.0 * close)
        turned = angle
    assert passed == pytest.approx(time - begin, abs=1e-6) and time > 4.0 - 2.0 * LONGEST_LAG
    assert count > (0.99 - 1.3 * lost[0] - 0.5 * (late[0] > 0.0)) * 4.0 / JOINTS


def test_a_silent_imu_is_no_measurement():
    """Without the IMU joints are let through after a while, unmeasured; its first sample counts for all that time."""
    sensors = Sensors()
    streams = Streams(sensors.robot)
    sensors.cycle()
    streams.start()
    list(measurements(sensors, streams, 0.1))
    sensors._lost = (0.0, 1.0)
    silent = [measured for _, _, measured, *_ in measurements(sensors, streams, 0.5)]
    assert not any(silent[10:]) and len(silent) > 90
    sensors._lost = (0.0, 0.0)
    speed = [speed for _, _, measured, _, speed in measurements(sensors, streams, 0.05) if measured][0]
    assert speed == pytest.approx((heading(0.61) - heading(0.105)) / 0.505, abs=0.02)


def test_frozen_joints_are_no_measurement():
    """Joints that move, by their velocities, and stay are no joints at rest that leap in the end, whatever the stamps.

    The first that are new count for all that time, with the mean of the turn's rate, of which no sample is left.
    """
    sensors = Sensors()
    streams = Streams(sensors.robot)
    sensors.cycle()
    streams.start()
    list(measurements(sensors, streams, 0.1))
    sensors.frozen = sensors.time
    assert len(list(measurements(sensors, streams, 1.0))) <= 1 and streams.ahead == LONGEST_EXTRAPOLATION
    sensors.frozen = math.inf
    time, elapsed, measured, _, speed = next(measurements(sensors, streams, 0.05))
    assert measured and elapsed == pytest.approx(1.0, abs=0.01)
    before = time - elapsed
    assert speed == pytest.approx((heading(time) - heading(before)) / elapsed, abs=1e-3)


def test_the_base_goes_on_while_joints_are_silent():
    sensors = Sensors()
    streams = Streams(sensors.robot)
    sensors.cycle()
    streams.start()
    list(measurements(sensors, streams, 0.1))
    assert streams.ahead <= JOINTS + 1e-6
    sensors._lost = (1.0, 0.0)
    list(measurements(sensors, streams, 0.06))
    assert streams.ahead == pytest.approx(0.06, abs=JOINTS + IMU)
    list(measurements(sensors, streams, 1.0))
    assert streams.ahead == LONGEST_EXTRAPOLATION


def test_a_known_offset_of_the_clocks_counts():
    """An IMU whose clock is 8 ms behind measures the same, where the offset is configured."""
    for offset, close in ((0.008, 1e-4), (0.0, 0.02)):
        sensors = Sensors(behind=0.008)
        streams = Streams(sensors.robot, offset)
        sensors.cycle()
        streams.start()
        errors = [angle - heading(time) for time, _, _, angle, _ in measurements(sensors, streams, 1.0)]
        assert np.abs([math.remainder(each, 2.0 * math.pi) for each in errors]).max() < close
    assert np.abs(errors[5:10]).max() % math.pi > 0.01


@pytest.mark.parametrize(
    ("behind", "kind"), [(-CLOCK, "zero"), (3600.0, "of another clock"), (-3600.0, "of another clock")]
)
def test_an_imu_of_another_clock_does_not_count(behind, kind):
    """The base is not turned by samples whose time is not known; they are counted, with the name of the sender."""
    sensors = Sensors(behind=behind)
    if kind == "zero":
        sensors.imu.add = lambda stamp, *rest: History.add(sensors.imu, 0.0, *rest)
    sensors.imu.sender = "/imu_driver"
    streams = Streams(sensors.robot)
    sensors.cycle()
    streams.start()
    assert not any(measured for _, _, measured, *_ in measurements(sensors, streams, 0.5))
    _, check = streams.stamp_checks
    assert check.refused[kind] > 140 and check.warning.endswith(f"/imu_driver is {kind}")


@pytest.mark.parametrize("speed", [0.03, 0.2, 0.7])
def test_a_simulation_slower_than_real_time_has_one_clock(speed):
    """Joints and IMU fall behind the clock alike, with stalls and changes of speed; their stamps stay 1 ms apart."""
    draw = np.random.default_rng(4)
    joints = StampCheck()
    imu = StampCheck(joints)
    clock = stamp = 0.0
    for step in range(20000):
        stamp = 1.0 + 0.001 * step
        clock += 0.001 / (speed if (step // 4000) % 2 else 1.0) + (0.5 if draw.uniform() < 5e-4 else 0.0)
        if step % 5 == 0:
            joints.before = joints.newest
            assert joints.accepts(stamp, clock + draw.uniform(0.0, 0.02), 0.0, "")
        if step % 2 == 0 and step:
            assert imu.accepts(stamp - 0.001, clock + draw.uniform(0.0, 0.02), 0.0, "")
    assert clock > 5.0 + 8.0 / speed and not joints.warning and not imu.warning


def test_what_arrives_together_after_a_gap_has_one_clock():
    """A process that stood still finds half a second of both, joints first: the IMU's first samples count, too."""
    joints = StampCheck()
    imu = StampCheck(joints)
    assert joints.accepts(1.0, 0.0, 0.0, "") and imu.accepts(1.0, 0.0, 0.0, "")
    joints.before = joints.newest
    assert all(joints.accepts(1.0 + 0.005 * step, 0.5, 0.0, "") for step in range(1, 100))
    assert all(imu.accepts(1.0 + 0.002 * step, 0.5, 0.0, "") for step in range(1, 250))


@pytest.mark.parametrize(("ahead", "warning"), [(0.0, ""), (-2.0, "a stamp of imu is of another clock")])
def test_what_has_waited_for_the_start_has_one_clock(ahead, warning):
    """In the first cycle come all messages of 0.4 s, first those of the joints; an IMU 2 s behind is another clock."""
    joints = StampCheck()
    imu = StampCheck(joints)
    for check in (joints, imu):
        check.before = check.newest
    times = 7.0 + 0.005 * np.arange(80)
    assert all(joints.accepts(float(time), float(time) - 6.999, 0.0, "") for time in times)
    accepted = [imu.accepts(float(time) + ahead, float(time) - 6.999, 0.0, "imu") for time in times]
    assert imu.warning == warning
    assert all(accepted) if not warning else not any(accepted)


def test_an_imu_whose_clock_is_set_counts_as_another():
    """An IMU that goes on alone is fine; one that comes back 0.2 s off is not, whatever it arrives beside."""
    joints = StampCheck()
    imu = StampCheck(joints, offset=0.003)
    for time in np.arange(0.5, 1.0, 0.002):  # no joints yet, whose time it could be
        assert not imu.accepts(time, time - 1.0, -math.inf, "")
    assert not imu.warning
    assert joints.accepts(1.0, 0.0, -math.inf, "")
    assert all(imu.accepts(0.997 + 0.002 * step, 0.002 * step, -math.inf, "") for step in range(500))
    assert joints.accepts(1.998, 0.998, -math.inf, "")
    for time in 1.0 + 0.002 * np.arange(200):
        joints.before = joints.newest
        assert joints.accepts(1.0 + time, time, -math.inf, "")
        assert not imu.accepts(0.797 + time, time, -math.inf, "imu")
    assert imu.refused["of another clock"] == pytest.approx(100, abs=1) and imu.warning.startswith("a stamp of imu is")


def test_stamps_before_the_estimate_are_counted():
    check = StampCheck()
    assert check.accepts(5.0, 1.0, 4.0, "") and not check.accepts(5.0, 1.0, 5.0, "")
    assert check.refused["older than the estimate"] == 0
    assert not check.accepts(4.9, 1.0, 5.0, "") and check.refused["older than the estimate"] == 1


def test_a_track_sorts_and_forgets_the_oldest():
    track = SortedSamples(4, 1)
    for stamp in (3.0, 1.0, 2.0, 5.0):
        track.rows[track.insert(stamp)] = stamp
    assert track.insert(2.0) == -1 and track.insert(0.5) == -1
    track.rows[track.insert(4.0)] = 4.0
    assert track.stamps.tolist() == track.rows[:, 0].tolist() == [2.0, 3.0, 4.0, 5.0] and track.newest == 5.0
