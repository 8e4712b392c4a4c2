"""How much time passes for the robot: by the clock, or less in a simulation that is slower."""

from types import SimpleNamespace

import numpy as np
import pytest

from solfer.plugins.timing.limits import LATEST, LOST
from solfer.plugins.timing.robot_time import RobotTime

PERIOD = 0.005


class StampedClock:
    """A plugin's clock, and stamps that arrive as a test says.

    Attributes:
        passed: What passed for the robot in each cycle [s].
    """

    def __init__(self, epoch=1.7e9):
        self.feedback = SimpleNamespace(measures=True, stamp=0.0)
        self.time = 0.0
        self._epoch = epoch
        self.robot_time, self.passed, self.lost = RobotTime([object_without(), self.feedback], PERIOD), [], 0.0
        self.robot_time.restart(0.0)

    def cycle(self, stamp=None, periods=1):
        """Let a cycle begin some periods after the one before; a new stamp has come, or none [s]."""
        self.time += periods * PERIOD
        if stamp is not None:
            self.feedback.stamp = self._epoch + stamp
        self.passed.append(self.robot_time.advance(self.time, self.feedback.stamp, 0))
        self.lost += self.robot_time.state[LOST]
        return self.passed[-1]


def object_without():
    """Return a feedback that does not measure: what is desired."""

    class Desired:
        measures, stamp = False, 123.0

    return Desired()


@pytest.mark.parametrize("late", [0.0, 0.015])
def test_the_clock_counts_as_it_is_while_messages_come(late):
    """Jitter, losses and left-out cycles change nothing, to the bit."""
    bench, random = StampedClock(), np.random.default_rng(2)
    for _ in range(2000):
        periods = int(random.choice((1, 1, 1, 2, 4)))
        stamp = bench.time + periods * PERIOD - random.uniform(0.0, late)
        assert bench.cycle(None if random.uniform() < 0.1 else stamp, periods) == periods * PERIOD
    assert bench.lost == 0.0


@pytest.mark.parametrize("factor", [0.1, 0.45, 0.9, 1.5])
def test_time_follows_a_robot_that_is_slower_or_faster(factor):
    """As soon as it is seen, as much time passes as the stamps show, and none in between."""
    bench, real = StampedClock(), 0.0
    for k in range(4000):
        real += factor * PERIOD
        bench.cycle(real if k % 3 == 0 else None)
    assert abs(sum(bench.passed) - real) < LATEST + 0.02 * bench.time and min(bench.passed) > 0.0
    later = np.array(bench.passed[2000:])
    assert later.mean() == pytest.approx(factor * PERIOD, rel=0.08)
    assert np.median(later.reshape(-1)[later > 0.5 * PERIOD * factor]) == pytest.approx(3.0 * factor * PERIOD, rel=0.01)
    assert bench.lost == pytest.approx(bench.time - sum(bench.passed), abs=1e-9)


def test_a_robot_that_stood_still_for_a_moment_is_waited_for():
    """A pause of the transport: time stops within 0.1 s, what was left out follows, and then the clock counts again."""
    bench = StampedClock()
    for k in range(100):
        bench.cycle(PERIOD * k)
    for _ in range(60):
        bench.cycle()
    assert 0.0 < bench.passed[-1] < 0.2 * PERIOD and sum(bench.passed[100:]) < LATEST + 3.0 * PERIOD
    for k in range(160, 160 + round(2.5 / PERIOD)):
        bench.cycle(PERIOD * k)
    assert sum(bench.passed) == pytest.approx(bench.time, abs=LATEST + 0.01)
    assert bench.cycle() == PERIOD == bench.cycle()


@pytest.mark.parametrize("stamps", ["none", "frozen", "set"])
def test_stamps_that_mean_nothing_do_not_stop_it(stamps):
    """A driver without stamps, with one stamp for ever, and a clock that is set by an hour."""
    bench = StampedClock(0.0 if stamps == "none" else 1.7e9)
    for k in range(400):
        bench.cycle({"none": 0.0, "frozen": 1.0, "set": PERIOD * k + 3600.0 * (k > 200)}[stamps])
    late = bench.passed[round(0.5 / PERIOD) + 1 :]
    assert all(each == pytest.approx(PERIOD) for each in (bench.passed if stamps != "frozen" else late))


def test_it_goes_by_the_clock_without_a_robot_that_is_measured():
    robot_time = RobotTime([object_without()], PERIOD)
    robot_time.restart(0.0)
    passed = [robot_time.advance(PERIOD * k, robot_time.feedback.stamp, 0) for k in (1, 2, 4)]
    assert passed == pytest.approx([PERIOD, PERIOD, 2.0 * PERIOD])
