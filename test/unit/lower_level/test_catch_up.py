"""Springs' targets follow a stream of commands exactly, and move smoothly to a command that jumps."""

import numpy as np
import pytest
from support.controllers import accept

from solfer.lower_level import ImpedanceController, JointLimits
from solfer.transport.messages import JointMessage

DT = 0.001  # [s]
LIMIT, SPEED = 3.0, 10.0  # [rad], [rad/s]


class Joint:
    """A joint on a spring, and the path of the spring's target, one position each millisecond."""

    def __init__(self):
        self.controller = ImpedanceController(
            "joint",
            JointLimits(
                ("joint",), np.array([0]), np.array([-LIMIT]), np.array([LIMIT]), np.array([SPEED]), np.array([100.0])
            ),
            [100.0],
            [1.0],
        )
        self.controller.start(np.zeros(1))
        self.path = [0.0]

    def command(self, position):
        """Send a position."""
        accept(self.controller, JointMessage(("joint",), position=np.array([position])))

    def run(self, steps):
        """Let milliseconds pass."""
        for _ in range(steps):
            self.controller.advance(DT)
            self.path.append(float(self.controller.target[0]))

    def stream(self, positions, period=5):
        """Send positions, one each `period` [ms]."""
        for position in positions:
            self.command(position)
            self.run(period)

    def speeds(self, over=0.005):
        """Compute mean speeds over a time that is a multiple of the period of the stream [rad/s]."""
        steps = round(over / DT)
        return (np.array(self.path[steps:]) - np.array(self.path[:-steps])) / over


@pytest.fixture
def joint():
    """Make a joint at zero, at rest."""
    return Joint()


@pytest.mark.parametrize("period", [1, 2, 5, 10])
def test_a_stream_is_followed_exactly(joint, period):
    times = np.arange(0.0, 2.0, period * DT)
    sent = 1.2 * (1.0 - np.cos(2.0 * np.pi * times / 2.0))  # up to 3.8 rad/s
    joint.stream(sent, period)
    np.testing.assert_allclose(joint.path[period::period], sent, atol=1e-12)


def test_a_stream_may_change_its_speed_fast(joint):
    """By 1.5 rad/s from command to command, which is below a jump and more than what a jump adds to its speed."""
    speeds = np.array([0.0, 1.5, 3.0, 4.5, 6.0, 7.5, 6.0, 4.5, 3.0, 1.5, 0.0, -1.5, -3.0, -4.5, -3.0, -1.5, 0.0])
    sent = np.cumsum(0.005 * speeds)
    joint.stream(sent)
    np.testing.assert_allclose(joint.path[5::5], sent, atol=1e-12)


@pytest.mark.parametrize("pause", [0, 300])
def test_each_joint_has_a_stream_of_its_own(pause):
    """Commands of one joint do not count as commands of the other, which has been silent since its start."""
    names = ("first", "second")
    limits = JointLimits(
        names,
        np.arange(2),
        np.full(2, -LIMIT),
        upper=np.full(2, LIMIT),
        velocity=np.full(2, SPEED),
        effort=np.full(2, 100.0),
    )
    controller, position = ImpedanceController("both", limits, np.full(2, 100.0), np.ones(2)), np.full(2, 0.5)

    def command(joint):
        accept(controller, JointMessage(names[joint : joint + 1], position=position[joint : joint + 1]))

    for _ in range(2):  # a start forgets what was commanded
        controller.start(position)
        for _ in range(pause):
            position[0] += 0.5 * DT
            command(0)
            controller.advance(DT)
        command(0)
        controller.advance(DT)
        position[1] += 0.009  # less than a jump, for a joint that was not commanded a moment ago
        command(1)
        controller.advance(DT)
        np.testing.assert_allclose(controller.target, position, atol=1e-15)
        command(1)  # pending at the next start


@pytest.mark.parametrize("ahead", [0.05, 0.1, 0.75, -0.4])
def test_a_robot_that_stood_still_catches_up_smoothly(joint, ahead):
    """The sender went on meanwhile: its stream of 0.5 rad/s is `ahead` of the robot."""
    step = 0.5 * 0.005
    joint.stream(step * np.arange(100))
    begin = len(joint.path)
    sent = 99 * step + ahead + step * np.arange(1, 301)
    joint.stream(sent)
    speeds = joint.speeds()[begin - 5 :]
    assert np.abs(speeds - 0.5).max() < min(0.4 * abs(ahead) * 10.0, 0.2 * SPEED) + 0.01
    pause = 0.5 if ahead < 0.0 else 0.0  # a jump back has no step of the stream in it
    assert np.abs(np.diff(speeds)).max() < 100.0 * abs(ahead) * DT + pause + 1e-3  # o'' = w^2 o at most
    behind = sent - joint.path[begin + 4 :: 5]
    assert (np.sign(ahead) * behind).min() > -1e-6, "it overshoots"
    assert abs(behind[200]) < 1e-3 < abs(behind[20])


@pytest.mark.parametrize("speed", [0.7, 0.95])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_fast_stream_is_caught_up_with_what_it_leaves(joint, speed, side):
    """The robot stood still while its sender went on; links that swing need a margin to the joint's limit."""
    step = side * speed * SPEED * 0.005
    sent = step * np.arange(10)
    joint.stream(sent)
    begin = len(joint.path)
    sent = sent[-1] + side * 0.3 + step * np.arange(1, 20)
    joint.stream(sent)
    joint.run(100)  # the stream has ended
    assert np.abs(joint.speeds()[begin:]).max() < max(0.8, speed) * SPEED + 0.25  # steps of its messages
    joint.run(1500)
    assert joint.path[-1] == pytest.approx(sent[-1], abs=1e-3)


def test_a_stalled_sender_goes_on_where_it_was(joint):
    step = 1.0 * 0.005
    joint.stream(step * np.arange(50))
    joint.run(300)
    joint.stream(step * np.arange(49, 100))
    assert joint.path[-1] == pytest.approx(99 * step, abs=1e-9)
    assert np.abs(joint.speeds()).max() < 1.0 + 1e-9


def test_messages_in_bunches_are_one_stream(joint):
    step = 1.0 * 0.005
    for bunch in range(40):
        for number in range(4):
            joint.command(step * (4 * bunch + number))
        joint.run(20)
    assert joint.path[-1] == pytest.approx(159 * step, abs=1e-3)


def test_an_emptied_queue_is_not_a_fast_stream(joint):
    """The robot stood still; the commands sent meanwhile come in portions, one each millisecond."""
    step = 0.5 * 0.005
    joint.stream(step * np.arange(100))
    begin = len(joint.path)
    joint.stream(step * (99 + 16 * np.arange(1, 10)), period=1)
    joint.run(1500)
    assert np.abs(joint.speeds()[begin - 5 :]).max() < 2.0
    assert joint.path[-1] == pytest.approx(step * (99 + 144), abs=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["upper", "lower"])
def test_a_jump_back_stays_within_the_limits(joint, side):
    joint.command(side * LIMIT)
    joint.run(900)
    joint.command(side * (LIMIT - 0.3))
    joint.run(20)
    joint.command(side * LIMIT)
    joint.run(2000)
    assert max(side * np.array(joint.path)) <= LIMIT
    assert np.abs(np.diff(joint.path, 2)).max() / DT**2 < 400.0  # the speed never jumps


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["upper", "lower"])
def test_the_limits_end_what_swings_beyond_a_stream(joint, side):
    """A target that catches up fast swings beyond a new stream that begins where it is, and no further than it may."""
    joint.command(side * (LIMIT - 0.3))
    joint.run(1500)
    joint.command(side * LIMIT)
    joint.run(100)
    joint.stream(side * np.linspace(side * joint.path[-1], LIMIT, 24))
    beyond = side * np.array(joint.path)[-60:]
    assert beyond.max() == LIMIT and np.count_nonzero(beyond == LIMIT) > 5
    joint.run(500)
    assert max(side * np.array(joint.path)) == LIMIT


def test_a_start_ends_catching_up(joint):
    joint.command(2.0)
    joint.run(50)
    joint.controller.start(np.array([0.1]))
    joint.run(100)
    assert joint.path[-100:] == [0.1] * 100
