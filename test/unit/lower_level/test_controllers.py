"""Commands are applied whole or refused whole."""

import numpy as np
import pytest
from support.controllers import accept

from solfer.errors import CommandRefused, NotFinite, SizeMismatch
from solfer.lower_level import ImpedanceController, JointLimits, VelocityController
from solfer.transport.messages import JointMessage

JOINTS = ("hip", "knee", "ankle")
DT = 0.001  # [s]


@pytest.fixture
def limits():
    """Return the limits of three joints; the ankle has no position limit."""
    return JointLimits(
        JOINTS,
        np.array([6, 7, 8]),
        np.array([-1.0, -2.0, -np.inf]),
        np.array([1.0, 0.5, np.inf]),
        np.array([2.0, 4.0, 8.0]),
        np.array([100.0, 50.0, 10.0]),
    )


@pytest.fixture
def springs(limits):
    """Make an impedance controller at (0.1, 0.2, 0.3)."""
    controller = ImpedanceController("legs", limits, [1000.0, 500.0, 100.0], [10.0, 5.0, 1.0])
    controller.start(np.array([0.1, 0.2, 0.3]))
    return controller


@pytest.fixture
def wheels(limits):
    """Make a velocity controller."""
    controller = VelocityController("wheels", limits)
    controller.start(np.zeros(3))
    return controller


def numbers(controller):
    """Return all commanded values of an impedance controller."""
    return np.concatenate(
        [getattr(controller, name) for name in ("position", "velocity", "effort", "stiffness", "damping")]
    )


def test_a_start_holds_with_the_default_gains(springs):
    np.testing.assert_array_equal(numbers(springs), [0.1, 0.2, 0.3, *[0.0] * 6, 1000, 500, 100, 10, 5, 1])
    np.testing.assert_array_equal(springs.target, [0.1, 0.2, 0.3])


def test_joints_are_mapped_by_name(springs):
    accept(springs, JointMessage(("ankle", "hip"), position=np.array([2.0, -0.5]), stiffness=np.array([7.0, 8.0])))
    np.testing.assert_array_equal(springs.position, [-0.5, 0.2, 2.0])
    for _ in range(250):
        springs.advance(0.001)
    np.testing.assert_array_equal(springs.stiffness, [8.0, 500.0, 7.0])
    np.testing.assert_array_equal(springs.damping, [10.0, 5.0, 1.0])


@pytest.mark.parametrize(
    "message, published",
    [
        (JointMessage(("hip", "knee"), position=np.array([0.0, np.nan])), ["knee", "not a finite number"]),
        (JointMessage(("hip", "knee"), position=np.array([0.0, np.inf])), ["knee", "not a finite number"]),
        (JointMessage(("ankle",), velocity=np.array([-np.inf])), ["ankle", "not a finite number"]),
        (JointMessage(("hip", "kne"), position=np.zeros(2)), ["unknown joint 'kne'", "knee"]),
        (JointMessage(("hip", "hip"), position=np.zeros(2)), ["'hip'", "2 times"]),
        (JointMessage(("hip", "knee"), position=np.zeros(3)), ["'position'", "(3,)", "2 numbers"]),
        (JointMessage(("hip",), position=np.zeros((1, 1))), ["'position'", "(1, 1)"]),
        (JointMessage(("hip",), position=np.zeros(1), effort=np.zeros(2)), ["'effort'", "(2,)"]),
        (JointMessage(("hip",), position=["a"]), ["'position'", "not an array of numbers"]),
        (JointMessage(("hip", "knee"), position=np.array([0.0, 0.51])), ["0.51", "knee", "from -2 to 0.5 [rad]"]),
        (JointMessage(("hip",), position=np.array([-1.1])), ["-1.1", "hip", "from -1 to 1 [rad]"]),
        (JointMessage(("knee",), velocity=np.array([4.1])), ["4.1", "knee", "from -4 to 4 [rad/s]"]),
        (JointMessage(("ankle",), effort=np.array([-11.0])), ["-11", "ankle", "from -10 to 10 [Nm]"]),
        (JointMessage(("hip",), stiffness=np.array([-1.0])), ["stiffness -1", "hip", "from 0"]),
        (JointMessage(("hip",), stiffness=np.array([2e5])), ["stiffness 200000", "hip", "to 100000"]),
        (JointMessage(("hip",), interfaces=("bias",), values=np.zeros((1, 1))), ["does not accept 'bias'", "position"]),
        (JointMessage(("hip",), damping=np.array([-1.0])), ["damping -1", "hip", "from 0"]),
        (JointMessage(("hip",)), ["no numbers"]),
        (JointMessage((), position=np.zeros(0)), ["no numbers"]),
    ],
)
def test_a_wrong_command_is_refused_whole(springs, message, published):
    before = numbers(springs)
    message.sender = "/ik"
    with pytest.raises(CommandRefused) as refusal:
        accept(springs, message)
    for text in (*published, "/ik", "legs"):
        assert text in str(refusal.value)
    np.testing.assert_array_equal(numbers(springs), before)


def test_a_limit_itself_is_accepted(springs):
    accept(springs, JointMessage(("hip", "knee"), position=np.array([-1.0, 0.5]), velocity=np.array([2.0, -4.0])))
    np.testing.assert_array_equal(springs.position, [-1.0, 0.5, 0.3])


def test_the_springs_keep_to_the_joints_speed_limits(springs):
    """Both after a jump of the command and behind a stream that is faster than the joint."""
    accept(springs, JointMessage(("hip",), position=np.array([1.0])))
    path = [springs.target.copy()]
    for step in range(1000):
        accept(springs, JointMessage(("knee",), position=np.array([max(-2.0, 0.2 - 0.006 * step)])))
        springs.advance(DT)
        path.append(springs.target.copy())
    speed = np.abs(np.diff(path, axis=0)).max(axis=0) / DT
    np.testing.assert_allclose(speed, [0.4, 4.0, 0.0], rtol=1e-9)
    for _ in range(3000):
        springs.advance(DT)
    np.testing.assert_allclose(springs.target, [1.0, -2.0, 0.3], atol=1e-12)


def test_a_velocity_expires_and_a_position_does_not(springs):
    accept(springs, JointMessage(("hip",), position=np.array([0.5]), velocity=np.array([1.0]), effort=np.array([3.0])))
    for _ in range(499):
        springs.advance(DT)
    assert springs.velocity[0] == 1.0
    for _ in range(2000):
        springs.advance(DT)
    assert (springs.velocity[0], springs.position[0], springs.effort[0]) == (0.0, 0.5, 3.0)


def test_each_wheel_needs_its_own_commands(wheels):
    accept(wheels, JointMessage(JOINTS, velocity=np.array([1.0, 2.0, 3.0])))
    for _ in range(400):
        wheels.advance(DT)
    accept(wheels, JointMessage(("ankle",), velocity=np.array([4.0])))
    for _ in range(400):
        wheels.advance(DT)
    np.testing.assert_array_equal(wheels.velocity, [0.0, 0.0, 4.0])


@pytest.mark.parametrize("field", ["position", "effort", "stiffness", "damping"])
def test_a_velocity_controller_accepts_velocities_only(wheels, field):
    message = JointMessage(("hip",), velocity=np.array([1.0]), **{field: np.zeros(1)})
    with pytest.raises(CommandRefused, match=f"does not accept '{field}'"):
        accept(wheels, message)
    assert not wheels.velocity.any()


def test_gains_are_checked(limits):
    with pytest.raises(SizeMismatch, match="2 values of stiffness for 3 joints"):
        ImpedanceController("legs", limits, [1.0, 2.0], [1.0, 2.0, 3.0])
    with pytest.raises(NotFinite, match="damping nan of joint 'knee'"):
        ImpedanceController("legs", limits, [1.0, 2.0, 3.0], [1.0, np.nan, 3.0])
