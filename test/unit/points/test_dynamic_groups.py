"""Dynamic points together: sums, Handlers, refusals, memory."""

import gc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.allocations import check_that_it_keeps_no_memory
from support.unit.random_states import OFFSET, accelerate, load

from solfer.errors import NotFinite, PointError, SizeMismatch, UnknownName
from solfer.points import (
    AngularAcceleration,
    Constant,
    ConstraintForce,
    ContactForces,
    DynamicPoint,
    Force,
    Handler,
    LinearAcceleration,
    LinearPoint,
    Minus,
    RollingContact,
    SpatialAcceleration,
    SupportVertexAcceleration,
    Torque,
    Wrench,
    minus,
)


def test_sums_and_differences_have_offsets_of_their_own(robot):
    """Value = J x + offset must hold for sums, shifts and errors too, or controllers would lose dJ v."""
    first, second = LinearAcceleration("arm1_7", robot), LinearAcceleration("torso_2", robot, OFFSET)
    relative, total = first - second, first + second
    shifted, negative = first + (1.0, 2.0, 3.0), (1.0, 2.0, 3.0) - first
    error = Constant((3.0, 2.0, 1.0)) - first
    assert isinstance(relative, Minus) and isinstance(minus(first, second=second), DynamicPoint)
    handler = Handler([first, second, relative, total, shifted, negative, error, LinearPoint("arm1_7", robot)])
    for seed in range(2):
        accelerate(robot, seed)
        handler.update()
        for point, offset in (
            (relative, first.offset - second.offset),
            (total, first.offset + second.offset),
            (shifted, first.offset + (1, 2, 3)),
            (negative, (1, 2, 3) - first.offset),
            (error, (3, 2, 1) - first.offset),
        ):
            assert_allclose(point.offset, offset, rtol=0.0, atol=1e-12)
            assert_allclose(point.jacobian @ point.x + point.offset, point.value, rtol=0.0, atol=1e-9)
        assert_allclose(
            handler.offset,
            np.concatenate([point.offset for point in handler if point is not handler[-1]] + [np.zeros(3)]),
        )


def test_assigned_offsets_hold_until_the_next_update(robot):
    first, second = LinearAcceleration("arm1_7", robot), LinearAcceleration("torso_2", robot)
    for point in (first, second):
        point.update()
    offset = first.offset.copy()
    first += second
    first -= (1.0, 2.0, 3.0)
    assert_allclose(first.offset, offset + second.offset - (1.0, 2.0, 3.0))
    assert_allclose(first.jacobian @ first.x + first.offset, first.value, rtol=0.0, atol=1e-9)
    first.assign(second)
    assert_allclose(first.offset, second.offset)
    first.update()
    assert_allclose(first.offset, offset)


def test_handler_offsets_are_views_or_copies(robot):
    owned, point, force = LinearAcceleration("arm1_7", robot), LinearPoint("pelvis", robot), Force("arm2_7", robot)
    first, second = Handler([owned, force]), Handler([point, force, owned])
    for seed in range(3):
        accelerate(robot, seed)
        first.update()
        second.update()
        assert_allclose(first.offset, np.concatenate([owned.offset, force.offset]))
        assert_allclose(second.offset, np.concatenate([np.zeros(3), force.offset, owned.offset]))
        assert_allclose(second.value, np.concatenate([point.value, force.value, owned.value]))
        assert_allclose(second.jacobian[3:], np.vstack([force.jacobian, owned.jacobian]))
    assert np.shares_memory(owned.offset, first.offset) and first.offset is first.offset
    removed, offset = first.remove(owned), owned.offset.copy()
    assert not np.shares_memory(removed.offset, first.offset)
    assert_allclose(removed.offset, offset)


def test_without_jacobian_offsets_and_values_are_computed(robot):
    points = [LinearAcceleration("arm1_7", robot), Force("arm1_7", robot)]
    handler = Handler(points)
    handler.update()
    before = handler.jacobian.copy()
    accelerate(robot, 1)
    handler.update(jacobian=False)
    assert_allclose(handler.jacobian, before)
    value, offset = handler.value.copy(), handler.offset.copy()
    handler.update()
    assert_allclose(handler.value, value, rtol=1e-12)
    assert_allclose(handler.offset, offset, rtol=1e-12)


def test_forces_subscribe_to_dynamics_while_alive(robot):
    robot.dynamics.update()
    computed = robot.dynamics.manager.computed("inertia_inverse")
    force = Force("arm1_7", robot)
    accelerate(robot, 1)
    robot.dynamics.update()
    assert robot.dynamics.manager.computed("inertia_inverse") == computed + 1
    del force
    gc.collect()
    accelerate(robot, 2)
    robot.dynamics.update()
    assert robot.dynamics.manager.computed("inertia_inverse") == computed + 1


def test_what_does_not_fit_is_refused(robot):
    """Unknown links, NaN, wrong sizes, foreign Robots and points without forces: all fail when the point is made."""
    for kind in (LinearAcceleration, AngularAcceleration, SpatialAcceleration, Force, Torque, Wrench):
        with pytest.raises(UnknownName, match="unknown link 'arm1-7'") as error:
            kind("arm1-7", robot)
        assert "arm1_7" in error.value.names
    for kind in (LinearAcceleration, SpatialAcceleration, Force, Wrench):
        with pytest.raises(NotFinite):
            kind("arm1_7", robot, (np.nan, 0.0, 0.0))
        with pytest.raises(SizeMismatch):
            kind("arm1_7", robot, (0.0, 0.0))
    force = Force("arm1_7", robot)
    with pytest.raises(NotFinite):
        force.demand((0.0, np.inf, 0.0))
    with pytest.raises(SizeMismatch, match="3 numbers"):
        force.demand((0.0, 0.0))
    for kind in (ConstraintForce, ContactForces):
        with pytest.raises(PointError, match="forces of no constraint"):
            kind([])
    for point in (LinearPoint("arm1_7", robot), force):
        with pytest.raises(PointError, match="no force constrains"):
            ConstraintForce([point])
        with pytest.raises(PointError, match="no contact force"):
            ContactForces([point])
    other = LinearAcceleration("arm1_7", load("centauro")[0])
    for mix in (
        lambda: ConstraintForce([LinearAcceleration("arm1_7", robot), other]),
        lambda: LinearAcceleration("arm1_7", robot) - other,
        lambda: Handler([force, other]),
    ):
        with pytest.raises(PointError, match="another Robot"):
            mix()


def test_accelerations_forces_and_positions_are_not_added(robot):
    """Their Jacobians multiply different x: a sum would be nonsense, so it is refused, and the value stays."""
    acceleration = LinearAcceleration("arm1_7", robot)
    acceleration.update()
    value = acceleration.value.copy()
    with pytest.raises(PointError, match="same x"):
        LinearPoint("arm1_7", robot) - acceleration
    for other in (Force("arm1_7", robot), LinearPoint("arm1_7", robot)):
        for mix in (
            lambda other=other: acceleration - other,
            lambda other=other: acceleration + other,
            lambda other=other: acceleration.__iadd__(other),
            lambda other=other: acceleration.assign(other),
        ):
            with pytest.raises(PointError, match="same x"):
                mix()
    assert_allclose(acceleration.value, value)


@pytest.mark.slow
def test_a_cycle_of_dynamic_points_keeps_no_memory(robot):
    """A cycle of accelerations, forces and contacts must not allocate, as it runs in the real-time loop."""
    hand, elbow = SpatialAcceleration("arm1_7", robot), SpatialAcceleration("arm1_4", robot)
    handler = Handler(
        [
            hand,
            elbow,
            hand - elbow,
            SupportVertexAcceleration("wheel_1", robot, 0.01, 0.068),
            Force("wheel_2", robot),
            Wrench("arm2_7", robot),
            LinearPoint("pelvis", robot),
            ContactForces([RollingContact(f"wheel_{leg}", robot, 0.01, 0.068) for leg in range(1, 5)]),
        ]
    )

    def cycle():
        robot.state.position += 1e-5
        robot.dynamics.update()
        handler.update()

    check_that_it_keeps_no_memory(cycle)
    assert np.isfinite(handler.value).all()
