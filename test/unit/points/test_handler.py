"""The Handler: order, concatenation without copies, chains, mixed lists, and refusals."""

import copy
import gc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.allocations import check_that_it_keeps_no_memory
from support.robots import centauro

from solfer.errors import NotFinite, PointError, SizeMismatch
from solfer.numerics.solvers.damped_inverse import DampedInverse
from solfer.points import CenterOfMass, Constant, FrameOrientation, Handler, LinearPoint, Minus, Norm, Point


class Countdown(Point):
    """A point of a user that counts its updates."""

    def __init__(self, robot):
        super().__init__(1, robot)

    def compute(self):
        self.value[:] -= 1.0

    def compute_jacobian(self):
        self.jacobian[0, 0] = self.value[0]


@pytest.fixture
def robot():
    robot = centauro()
    robot.state.position[:] = np.random.default_rng(3).uniform(-0.5, 0.5, robot.size)
    robot.update()
    return robot


def move(robot):
    robot.state.position[:] += 0.01
    robot.update()


def test_values_and_jacobians_are_concatenated_without_copies(robot):
    """Solvers keep references to these arrays: points must write into them, with the values they have alone."""
    points, alone = (
        [LinearPoint("arm1_7", robot), FrameOrientation("arm1_7", robot), CenterOfMass(robot), Constant((1.0, 2.0))]
        for _ in range(2)
    )
    handler = Handler(points)
    assert (handler.size, handler.rows, handler.cols, len(handler)) == (12, 11, 48, 4)
    value, jacobian = handler.value, handler.jacobian
    for _ in range(2):
        move(robot)
        handler.update()
        for point in alone:
            point.update()
        assert_allclose(value, np.concatenate([point.value for point in alone]))
        assert_allclose(jacobian[:9], np.vstack([point.jacobian for point in alone[:3]]))
        assert not jacobian[9:].any()
    assert handler.value is value and handler.jacobian is jacobian
    assert all(np.shares_memory(point.value, value) and np.shares_memory(point.jacobian, jacobian) for point in points)


def test_points_are_found_by_index_and_iteration(robot):
    points = [LinearPoint(link, robot) for link in ("arm1_7", "arm2_7", "pelvis")]
    handler = Handler(points)
    assert handler[0] is points[0] and handler[-1] is points[2]
    assert handler.end(0) is points[2] and handler.end(1) is points[1]
    assert list(handler) == points
    for index in (3, -4):
        with pytest.raises(PointError, match=f"no point {index} in a Handler of 3"):
            handler[index]


def test_a_point_may_use_points_before_it(robot):
    handler = Handler()
    for link in ("arm1_7", "arm2_7", "pelvis"):
        handler.add(LinearPoint(link, robot))
    handler.add(handler[0] - handler[2])
    handler.add(Norm(handler[-1]))
    move(robot)
    handler.update()
    distance = handler[0].value - handler[2].value
    assert_allclose(handler[3].value, distance)
    assert_allclose(handler.end(0).value, [np.linalg.norm(distance)])


def test_a_point_before_its_operands_is_late(robot):
    hand = LinearPoint("arm1_7", robot)
    handler = Handler([hand + (0.0, 0.0, 0.0), hand])
    handler.update()
    before = hand.value.copy()
    move(robot)
    handler.update()
    assert_allclose(handler[0].value, before)


def test_points_may_use_another_handlers_points(robot):
    tasks = Handler([LinearPoint("arm1_7", robot)])
    errors = Handler([Minus(tasks[0], Constant((1.0, 0.0, 0.0)))])
    for _ in range(3):
        move(robot)
        tasks.update()
        errors.update()
        assert_allclose(errors.value, tasks[0].value - (1.0, 0.0, 0.0))
        assert_allclose(errors.jacobian, tasks.jacobian[:3])
        tasks.add(LinearPoint("pelvis", robot))  # the arrays of the first point move


def test_an_update_comes_before_the_first_look(robot):
    hand, alone = LinearPoint("arm1_7", robot), LinearPoint("arm1_7", robot)
    first, second = Handler([hand]), Handler([hand, CenterOfMass(robot)])
    assert first.value is first.value  # the point is the first one's
    second.update()
    alone.update()
    assert_allclose(second.value[:3], alone.value)
    assert_allclose(second.jacobian[:3], alone.jacobian)


def test_two_handlers_may_have_one_point(robot):
    center = CenterOfMass(robot)
    first, second = Handler([LinearPoint("arm1_7", robot), center]), Handler([center, LinearPoint("pelvis", robot)])
    for handler in (second, first, second):
        move(robot)
        handler.update()
        rows = slice(3, 6) if handler is first else slice(0, 3)
        assert_allclose(handler.value[rows], robot.kinematics.center_of_mass, atol=1e-12)
        assert_allclose(handler.jacobian[rows], robot.kinematics.center_of_mass_jacobian, atol=1e-12)
        assert_allclose(center.value, robot.kinematics.center_of_mass, atol=1e-12)


def test_points_of_a_user_run_in_order(robot):
    hand, own = LinearPoint("arm1_7", robot), Countdown(robot)
    handler = Handler([own, hand, own + (0.5,)])
    handler.update()
    handler.update()
    assert_allclose(handler.value, [-2.0, *robot.kinematics.position("arm1_7"), -1.5])
    assert_allclose(handler.jacobian[4], handler.jacobian[0])
    shared = Handler([hand, own])
    shared.update()
    assert_allclose(shared.value, [*robot.kinematics.position("arm1_7"), -3.0])
    assert own.jacobian[0, 0] == shared.jacobian[3, 0] == -3.0


def test_a_subclass_may_compute_in_its_own_way(robot):
    class Doubled(LinearPoint):
        def compute(self):
            self.value[:] = 2.0

        def update(self, jacobian=True):
            self.compute()

    handler = Handler([Doubled("arm1_7", robot)])
    handler.update()
    assert_allclose(handler.value, (2.0, 2.0, 2.0))


def test_offsets_and_references_act_at_the_next_update(robot):
    handler = Handler([LinearPoint("arm1_7", robot), Constant(3)])
    handler.update()
    handler[0].position.set_fixed((0.0, 0.0, -0.15))
    handler[1].set((1.0, 2.0, 3.0))
    handler.update()
    kinematics = robot.kinematics
    hand = kinematics.position("arm1_7") + kinematics.rotation("arm1_7") @ (0.0, 0.0, -0.15)
    assert_allclose(handler.value, [*hand, 1.0, 2.0, 3.0])


def test_without_jacobians_only_values_are_computed(robot):
    handler = Handler([LinearPoint("arm1_7", robot), CenterOfMass(robot)])
    handler.update()
    before = handler.jacobian.copy()
    move(robot)
    handler.update(jacobian=False)
    assert_allclose(handler.jacobian, before)
    assert_allclose(handler.value, [*robot.kinematics.position("arm1_7"), *robot.kinematics.center_of_mass])


def test_removed_points_keep_their_numbers_and_live_on(robot):
    handler = Handler([LinearPoint("arm1_7", robot), LinearPoint("arm2_7", robot), LinearPoint("pelvis", robot)])
    handler.update()
    before = handler[1].value.copy()
    removed = handler.remove(-2)
    assert len(handler) == 2 and handler.size == 6
    assert_allclose(removed.value, before)
    move(robot)
    handler.update()
    removed.update()
    assert_allclose(removed.value, robot.kinematics.position("arm2_7"))
    assert_allclose(handler.value[3:], robot.kinematics.position("pelvis"))
    assert handler.remove(handler[0]).link == "arm1_7"
    with pytest.raises(PointError, match="not in this Handler"):
        handler.remove(removed)


def test_points_outlive_their_handler(robot):
    hand = Handler([LinearPoint("arm1_7", robot)])[0]
    difference = hand - LinearPoint("pelvis", robot)
    gc.collect()
    hand.update()
    difference.second.update()
    difference.update()
    expected = robot.kinematics.position("arm1_7") - robot.kinematics.position("pelvis")
    assert_allclose(difference.value, expected)


def test_an_empty_handler_and_one_of_constants_work():
    handler = Handler()
    handler.update()
    assert (handler.size, handler.rows, handler.cols) == (0, 0, 0)
    handler.add(Constant((1.0, 2.0)))
    handler.add(handler[0] + (1.0, 1.0))
    handler.update()
    assert_allclose(handler.value, (1.0, 2.0, 2.0, 3.0))
    assert handler.jacobian.shape == (4, 0)


def test_what_does_not_belong_here_is_refused(robot):
    """Points of another Robot, doubled points and wrong widths are refused, and the Handler stays as it was."""
    handler = Handler([LinearPoint("arm1_7", robot)])
    other = centauro()
    with pytest.raises(PointError, match="another Robot"):
        handler.add(LinearPoint("arm1_7", other))
    with pytest.raises(PointError, match="holds points, got str"):
        handler.add("arm1_7")
    with pytest.raises(PointError, match="already"):
        handler.add(handler[0])
    narrow = Constant(3)
    narrow.set(np.ones((3, 7)))
    with pytest.raises(SizeMismatch, match="7 columns.*48"):
        handler.add(narrow)
    with pytest.raises(NotFinite):
        handler.add(Constant((np.nan,)))
    assert len(handler) == 1


def test_a_jacobian_that_is_set_is_copied():
    matrix, point = np.ones((3, 7)), Constant(3)
    point.set(matrix)
    matrix[:] = 2.0
    assert (point.jacobian == 1.0).all()


def test_points_are_not_replaced_or_copied(robot):
    handler = Handler([LinearPoint("arm1_7", robot), LinearPoint("pelvis", robot)])
    handler.update()
    hand = handler[0].value.copy()
    handler[0] += handler[1]
    assert_allclose(handler.value[:3], hand + handler[1].value)
    with pytest.raises(PointError, match="not replaced"):
        handler[0] = LinearPoint("arm1_7", robot)
    for copied in (handler, handler[0]):
        with pytest.raises(PointError, match="LinearPoint of 'arm1_7'.* cannot be copied"):
            copy.deepcopy(copied)


@pytest.mark.parametrize(
    "change",
    [
        lambda handler, point: handler.add(Constant(1)),
        lambda handler, point: handler.remove(point),
        lambda handler, point: handler.update(),
    ],
    ids=["add", "remove", "update"],
)
def test_a_handler_is_not_changed_while_it_runs(robot, change):
    class Meddler(Countdown):
        def compute(self):
            change(handler, self)

    handler = Handler([LinearPoint("arm1_7", robot), Meddler(robot)])
    with pytest.raises(PointError, match="while it runs"):
        handler.update()
    handler.remove(1)
    handler.update()
    assert_allclose(handler.value, robot.kinematics.position("arm1_7"))


@pytest.mark.slow
def test_a_thousand_points_are_right(robot):
    links = list(robot.description.links)
    handler = Handler(LinearPoint(links[index % len(links)], robot) for index in range(1000))
    handler.update()
    expected = np.concatenate([robot.kinematics.position(point.link) for point in handler])
    assert_allclose(handler.value, expected, atol=1e-12)


def listing_3(robot):
    """Make centre of mass, and hands relative to the torso, with the errors from their references."""
    tasks, references, errors = Handler(), Handler(), Handler()
    torso = LinearPoint("torso_2", robot)
    targets = [tasks.add(CenterOfMass(robot))]
    tasks.add(torso)
    for link in ("arm1_7", "arm2_7"):
        hand = tasks.add(LinearPoint(link, robot))
        targets.append(tasks.add(hand - torso))
    tasks.update()
    for target in targets:
        references.add(Constant.like(target))
        errors.add(Minus(references[-1], target))
    return tasks, references, errors


def test_the_cycle_of_listing_3_keeps_no_memory(robot):
    tasks, references, errors = listing_3(robot)
    references[1].set(references[1].value + (0.05, 0.0, 0.02))
    inverse, step = DampedInverse(errors.rows, errors.cols, 1e-3), np.zeros(robot.size)

    def cycle():
        robot.update()
        tasks.update()
        errors.update()
        # the errors fall along q: their Jacobians are those of the tasks, negative
        inverse.solve(errors.jacobian, errors.value, step)
        robot.state.position -= step * 0.1

    check_that_it_keeps_no_memory(cycle)
    assert np.abs(errors.value).max() < 1e-3
