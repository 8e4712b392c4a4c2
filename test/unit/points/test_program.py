"""Programs of Handlers: which are made anew, which grow, and what they read of others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.robots import centauro

from solfer.errors import PointError
from solfer.points import (
    CenterOfPressure,
    Constant,
    Handler,
    LinearAcceleration,
    LinearPoint,
    Minus,
    Norm,
    Point,
    PointContact,
    RollingAcceleration,
    minus,
)
from solfer.points.compiled.registry import KERNELS, kernel

LINKS = ("arm1_7", "arm2_7", "pelvis", "torso_2", "wheel_1")


class CountedPoint(LinearPoint):
    """A compiled point that counts how often its instructions are made."""

    made = 0

    def instructions(self):
        self.made += 1
        return super().instructions()


@pytest.fixture(scope="module")
def robot():
    robot = centauro(contacts=False)
    robot.state.position[:] = np.random.default_rng(3).uniform(-0.5, 0.5, robot.size)
    robot.update()
    return robot


def made(handler):
    return [point.made for point in handler]


def check(handler):
    """Compare the numbers of a Handler of points on links with those of points alone."""
    alone = [LinearPoint(point.link, point.robot) for point in handler]
    for point in alone:
        point.update()
    assert_array_equal(handler.value, np.concatenate([point.value for point in alone]))
    assert_array_equal(handler.jacobian, np.vstack([point.jacobian for point in alone]))


def test_other_handlers_keep_their_programs(robot):
    """What one plugin changes costs another one nothing in its cycles."""
    mine, theirs = Handler(CountedPoint(link, robot) for link in LINKS), Handler([LinearPoint("pelvis", robot)])
    reference = theirs.add(Constant(3))
    for change in (
        lambda: theirs.add(LinearPoint("arm1_7", robot)),
        lambda: [theirs.add(LinearPoint("arm1_7", robot)) for _ in range(20)],
        lambda: theirs.remove(0),
        lambda: theirs[-1].__iadd__(theirs[0]),
        lambda: reference.set(np.ones((3, robot.size))),
        lambda: LinearPoint("arm2_7", robot).update(),
    ):
        mine.update()
        change()
        theirs.update()
    mine.update()
    assert made(mine) == [1] * len(LINKS)
    check(mine)


class InPython(Point):
    """A point of a user, which is not compiled."""

    def compute(self):
        self.value[:] = 1.0

    def compute_jacobian(self):
        self.jacobian[:] = 0.0


def test_compiled_points_are_one_call(robot, monkeypatch):
    """A call from Python costs as much as several points."""
    calls = []
    monkeypatch.setattr("solfer.points.program.run", lambda *arguments: calls.append(arguments))
    handler = Handler(LinearPoint(link, robot) for link in LINKS)
    handler.update()
    assert len(calls) == 1
    handler.add(InPython(1, robot))
    for _ in range(2):
        handler.add(LinearPoint("pelvis", robot))
    calls.clear()
    handler.update()
    assert len(calls) == 2


@pytest.mark.slow
def test_a_program_grows_by_new_points_only(robot):
    handler = Handler(CountedPoint("pelvis", robot) for _ in range(1000))
    handler.update()
    for link in LINKS:
        handler.add(CountedPoint(link, robot))
        handler.update()
    assert made(handler) == [1] * (1000 + len(LINKS))
    check(handler)


def test_a_removed_point_has_its_program_made_anew(robot):
    handler = Handler(CountedPoint(link, robot) for link in LINKS)
    handler.update()
    handler.remove(1)
    handler.update()
    handler.update()
    assert made(handler) == [2] * (len(LINKS) - 1)
    check(handler)


def test_points_are_added_between_updates(robot):
    """Beyond the room that there is, and with points of a user in between."""

    class Own(LinearPoint):
        def update(self, jacobian=True):
            super().update(jacobian)

    handler = Handler()
    for index in range(30):
        kind = Own if index % 7 == 3 else CountedPoint
        handler.add(kind(LINKS[index % len(LINKS)], robot))
        handler.update()
        check(handler)
        assert all(np.shares_memory(point.jacobian, handler.jacobian) for point in handler)


def test_a_first_point_brings_the_columns(robot):
    handler = Handler([Constant((1.0, 2.0, 3.0)), Constant((1.0, 0.0, 0.0))])
    handler.update()
    assert handler.jacobian.shape == (6, 0)
    handler.add(handler[0] - LinearPoint("arm1_7", robot))
    handler[2].second.update()
    handler.update()
    assert_allclose(handler.value[6:], (1.0, 2.0, 3.0) - robot.kinematics.position("arm1_7"))
    assert_allclose(handler.jacobian[6:], -robot.kinematics.jacobian("arm1_7")[:3], atol=1e-15)


def test_readers_follow_points_that_move(robot):
    """Adding and removing points moves memory: readers in other Handlers must not keep a stale address."""
    tasks = Handler([LinearPoint("arm1_7", robot)])
    errors = Handler([Minus(tasks[0], Constant(3))])
    norms = Handler([Norm(errors[0])])
    hand = tasks[0]
    for change in (
        lambda: [tasks.add(LinearPoint("pelvis", robot)) for _ in range(10)],
        lambda: tasks.remove(5),
        lambda: tasks.remove(hand),
        lambda: errors.add(Constant(1)),
        lambda: errors.remove(0),
    ):
        change()
        robot.state.position[:] += 0.01
        robot.update()
        for one in (tasks, hand, errors, norms[0].point, norms):
            one.update()
        assert_array_equal(norms[0].point.value, robot.kinematics.position("arm1_7"))
        assert_allclose(norms.value, [np.linalg.norm(robot.kinematics.position("arm1_7"))], rtol=1e-15)


def test_readers_follow_a_point_into_a_handler(robot):
    """It had arrays of its own when its readers were made; then it comes to those of a Handler, and leaves them."""
    hand, tasks = LinearPoint("arm1_7", robot), Handler([LinearPoint("pelvis", robot)])
    errors = Handler([hand - (0.1, 0.2, 0.3)])
    for change in (lambda: None, lambda: tasks.add(hand), lambda: tasks.remove(hand)):
        hand.update()
        errors.update()
        change()
        robot.state.position[:] += 0.01
        robot.update()
        for one in (tasks, hand, errors):
            one.update()
        assert_allclose(errors.value, robot.kinematics.position("arm1_7") - (0.1, 0.2, 0.3), rtol=1e-15)
        assert_array_equal(errors.jacobian, hand.jacobian)


def test_columns_that_are_added_reach_all_readers(robot):
    """A point that an operand of an operand was added to moves with other DoFs, too."""
    hand, wheel = LinearPoint("arm1_7", robot), LinearPoint("wheel_1", robot)
    tasks, norms = Handler([hand, wheel]), Handler([Norm(hand - (0.1, 0.2, 0.3))])
    difference = norms[0].point
    for one in (tasks, difference, norms):
        one.update()
    hand += wheel
    difference.update()
    norms.update()
    assert hand.jacobian[:, wheel.columns].any()
    assert_allclose(norms.jacobian[0], difference.value @ (hand.jacobian) / norms.value[0], rtol=1e-12)


def test_pressure_follows_contacts_that_come_and_go(robot):
    """The centre of pressure reads forces of a Handler that changes, and of wrenches moved elsewhere."""
    feet = Handler([PointContact("wheel_1", robot)])
    center = CenterOfPressure(feet)
    tasks = Handler([center])
    for link in ("wheel_2", "wheel_3"):
        feet.update()
        tasks.update()
        feet.add(PointContact(link, robot)).force[2] = 100.0
    feet.update()
    tasks.update()
    middle = 0.5 * (feet[1].value + feet[2].value)
    assert_allclose(center.value[:2], middle[:2], rtol=1e-12)
    wrench = np.zeros(6)
    feet[1].move_wrench(wrench)
    wrench[2] = 0.0
    feet.remove(0)
    feet.update()
    tasks.update()
    assert_allclose(center.value[:2], feet[1].value[:2], rtol=1e-12)


def test_a_shared_place_is_set_once(robot):
    contact, acceleration = PointContact("arm1_7", robot), LinearAcceleration("arm1_7", robot, (0.1, 0.2, 0.3))
    acceleration.update()
    acceleration.share_place(contact)
    contact.set_fixed((0.0, 0.0, 0.5))
    for expected in ((0.0, 0.0, 0.5), (0.3, 0.0, 0.0)):
        other = LinearAcceleration("arm1_7", robot, expected)
        other.update()
        acceleration.update()
        assert_array_equal(acceleration.jacobian, other.jacobian)
        acceleration.set_fixed((0.3, 0.0, 0.0))
    assert_allclose(contact.position.fixed, (0.3, 0.0, 0.0), atol=1e-15)
    for other in (LinearAcceleration("arm2_7", robot), RollingAcceleration("arm1_7", robot, 0.0, 0.1)):
        with pytest.raises(PointError, match=r"cannot be where PointContact of 'arm1_7'.* is"):
            other.share_place(contact)


def test_a_difference_without_offset_is_refused(robot):
    acceleration = LinearAcceleration("arm1_7", robot)
    with pytest.raises(PointError, match=r"Minus of LinearAcceleration of 'arm1_7'.* no offset") as error:
        Minus(acceleration, (1.0, 2.0, 3.0))
    assert "minus(first, second)" in error.value.expected
    assert_array_equal(minus(acceleration, (1.0, 2.0, 3.0)).x, robot.state.acceleration)


def test_each_kernel_registers_once_and_there():
    table = dict(KERNELS)
    for name, module in (("norm", "solfer.points.compiled.other"), ("other", "elsewhere")):

        def function(row, program, with_jacobian):
            pass

        function.__name__, function.__module__ = name, module
        with pytest.raises(ValueError, match=f"the kernel '{name}' of {module}"):
            kernel(function)
    assert table == KERNELS
