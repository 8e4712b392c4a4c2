"""Every point against finite differences: the change of its value over a step is its Jacobian times the velocity."""

import inspect
from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.random_states import OFFSET, ROBOTS, SLOPE, TURN, WHEEL, load, put, states

import solfer.points
from solfer import Robot
from solfer.points import (
    ORIENTATION,
    POSE,
    AngularMomentum,
    AngularVelocity,
    BallContact,
    CenterOfMass,
    CenterOfPressure,
    Constant,
    DynamicPoint,
    FrameOrientation,
    GroundFrame,
    Handler,
    LinearPoint,
    LinearVelocity,
    LookAt,
    Minus,
    Norm,
    Plus,
    Point,
    PointContact,
    Posture,
    RelativePoint,
    RollingContact,
    SpatialPoint,
    SpatialVelocity,
    SupportVertex,
    WheelFrame,
)

STEP = 1e-6


class Square(Point):
    """A point of a user: squares of the coordinates of another one."""

    def __init__(self, point: Point):
        super().__init__(point.size, point.robot)
        self.point = point

    def compute(self) -> None:
        self.value[:] = self.point.value**2

    def compute_jacobian(self) -> None:
        self.jacobian[:] = 2.0 * self.point.value[:, None] * self.point.jacobian


def minus(robot, a, b) -> list[Point]:
    points = [LinearPoint(a, robot, OFFSET), LinearPoint(b, robot)]
    return [*points, points[0] - points[1]]


def orientation_minus(robot, a, b) -> list[Point]:
    points = [FrameOrientation(a, robot), FrameOrientation(b, robot, TURN)]
    return [*points, points[0] - points[1]]


def orientation_error(robot, a, b) -> list[Point]:
    point = FrameOrientation(a, robot)
    return [point, point - Constant((0.1, 0.2, 0.3, 0.9), ORIENTATION), Constant(3)]


def reference_minus_pose(robot, a, b) -> list[Point]:
    points = [SpatialPoint(a, robot, OFFSET), SpatialPoint(b, robot)]
    return [points[0], Constant.like(points[1]) - points[0], points[1], points[1] - points[0]]


def norm(robot, a, b) -> list[Point]:
    points = minus(robot, a, b)
    return [*points, Norm(points[-1])]


def plus(robot, a, b) -> list[Point]:
    points = minus(robot, a, b)
    return [*points, points[-1] + points[0], points[0] + (1.0, 2.0, 3.0)]


def square(robot, a, b) -> list[Point]:
    points = minus(robot, a, b)
    return [*points, Square(points[-1]), Norm(points[0])]


def pressure(robot, a, b) -> list[Point]:
    contacts = [PointContact(a, robot, OFFSET), PointContact(b, robot), PointContact(b, robot, OFFSET)]
    for contact, force in zip(contacts, (30.0, 100.0, -5.0), strict=True):
        contact.force[:] = 20.0, 0.0, force
    return [*contacts, CenterOfPressure(contacts), CenterOfPressure(contacts, normal=(0.2, 0.0, 2.0))]


def posture(robot, a, b) -> list[Point]:
    points = [Posture(robot), Posture(robot, (robot.size - 1, 0, robot.dofs[2])), Posture(robot, robot.dofs[1])]
    return [*points, points[1] - (0.1, 0.2, 0.3)]


def relative(robot, a, b) -> list[Point]:
    points = [SpatialPoint(a, robot, OFFSET, TURN), LinearPoint(b, robot), FrameOrientation(b, robot, TURN)]
    ground, fixed = GroundFrame(points[0], 0.2), Constant((1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.9), POSE)
    seen = [RelativePoint(point, points[0]) for point in points[1:]]
    others = [RelativePoint(points[0], fixed), RelativePoint(points[1], ground), RelativePoint(fixed, points[0])]
    return [*points, ground, fixed, *seen, *others]


def level(kind, **tags):
    def points(robot, a, b) -> list[Point]:
        pose = SpatialPoint(a, robot, OFFSET, TURN)
        return [pose, kind(pose), kind(pose, normal=SLOPE, **tags)]

    return points


def look_at(robot, a, b) -> list[Point]:
    points = [SpatialPoint(a, robot, OFFSET, TURN), LinearPoint(b, robot)]
    return [*points, LookAt(points[0], points[1]), LookAt(points[0], (3.0, 1.0, -2.0))]


CASES: dict[str, tuple[type, Callable[[Robot, str, str], list[Point]]]] = {
    "LinearPoint": (LinearPoint, lambda robot, a, b: [LinearPoint(a, robot, OFFSET)]),
    "FrameOrientation": (FrameOrientation, lambda robot, a, b: [FrameOrientation(a, robot, TURN)]),
    "SpatialPoint": (SpatialPoint, lambda robot, a, b: [SpatialPoint(a, robot, OFFSET, TURN)]),
    "CenterOfMass": (CenterOfMass, lambda robot, a, b: [CenterOfMass(robot)]),
    "Constant": (Constant, lambda robot, a, b: [Constant((1.0, 2.0)), LinearPoint(b, robot)]),
    "Minus": (Minus, minus),
    "Minus of orientations": (Minus, orientation_minus),
    "Minus of an orientation and a reference": (Minus, orientation_error),
    "Minus of poses": (Minus, reference_minus_pose),
    "Norm": (Norm, norm),
    "Plus": (Plus, plus),
    "SupportVertex": (SupportVertex, lambda robot, a, b: [SupportVertex(a, robot, **WHEEL)]),
    "SupportVertex on a slope": (SupportVertex, lambda robot, a, b: [SupportVertex(a, robot, **WHEEL, normal=SLOPE)]),
    "PointContact": (PointContact, lambda robot, a, b: [PointContact(a, robot, OFFSET)]),
    "CenterOfPressure": (CenterOfPressure, pressure),
    "Posture": (Posture, posture),
    "RelativePoint": (RelativePoint, relative),
    "GroundFrame": (GroundFrame, level(GroundFrame, height=0.3, axis=(0.5, 0.2, 0.1))),
    "WheelFrame": (WheelFrame, level(WheelFrame, axle=(0.3, 1.0, -0.2))),
    "LookAt": (LookAt, look_at),
    "a user's point": (Point, square),
}
"""Points in the order of a Handler, by the name of their case."""

VELOCITIES: dict[type, Callable[[Robot, str], tuple[Point, Point]]] = {
    LinearVelocity: lambda robot, link: (LinearVelocity(link, robot, OFFSET), LinearPoint(link, robot, OFFSET)),
    AngularVelocity: lambda robot, link: (AngularVelocity(link, robot), FrameOrientation(link, robot)),
    SpatialVelocity: lambda robot, link: (SpatialVelocity(link, robot, OFFSET), SpatialPoint(link, robot, OFFSET)),
}
"""Velocities, with the points that they are the derivatives of."""


@pytest.fixture(scope="module", params=ROBOTS)
def robot_and_links(request):
    return load(request.param)


def test_no_point_is_forgotten():
    exported = [getattr(solfer.points, name) for name in solfer.points.__all__]
    points = {one for one in exported if inspect.isclass(one) and issubclass(one, Point)}
    # dynamic points: test_dynamic.py
    kinematic = {one for one in points if not issubclass(one, DynamicPoint)}
    wheels_and_balls = {RollingContact, BallContact}
    assert kinematic == {kind for kind, _ in CASES.values()} | set(VELOCITIES) | {AngularMomentum, *wheels_and_balls}


@pytest.mark.parametrize("alone", [False, True], ids=["in a Handler", "alone"])
@pytest.mark.parametrize("case", CASES)
def test_differences_are_jacobian_times_velocity(robot_and_links, case, alone):
    """Every kind of point, alone and in a Handler, whose program is another path through the same formulas."""
    robot, links = robot_and_links
    points = CASES[case][1](robot, *links)
    group = points if alone else Handler(points)
    for position, velocity in states(robot):
        put(robot, position - STEP * velocity, velocity)
        update(group)
        before = [point.value.copy() for point in points]
        put(robot, position + STEP * velocity, velocity)
        update(group)
        differences = [point.difference(value) for point, value in zip(points, before, strict=True)]
        put(robot, position, velocity)
        update(group)
        for point, difference in zip(points, differences, strict=True):
            rate = point.jacobian @ velocity if point.cols else np.zeros(point.rows)
            assert_allclose(rate, difference / (2.0 * STEP), atol=1e-6)


@pytest.mark.parametrize("kind", VELOCITIES)
def test_velocities_are_jacobian_times_velocity(robot_and_links, kind):
    """The differentiated position of the same body is the oracle for value and Jacobian of its velocity."""
    robot, links = robot_and_links
    point, body = VELOCITIES[kind](robot, links[0])
    for position, velocity in states(robot):
        put(robot, position - STEP * velocity, velocity)
        body.update()
        before = body.value.copy()
        put(robot, position + STEP * velocity, velocity)
        body.update()
        rate = body.difference(before) / (2.0 * STEP)
        put(robot, position, velocity)
        body.update()
        point.update()
        assert_allclose(point.value, rate, atol=1e-6)
        assert_allclose(point.value, point.jacobian @ velocity, atol=1e-12)
        assert_allclose(point.jacobian, body.jacobian, atol=1e-12)


def test_rolling_contacts_have_the_materials_jacobian(robot_and_links):
    robot, links = robot_and_links
    contact, material = RollingContact(links[0], robot, **WHEEL, normal=SLOPE), LinearPoint(links[0], robot)
    for position, velocity in states(robot):
        put(robot, position, velocity)
        contact.update()
        material.set_world(contact.value)
        put(robot, position - STEP * velocity, velocity)
        material.update(jacobian=False)
        before = material.value.copy()
        put(robot, position + STEP * velocity, velocity)
        material.update(jacobian=False)
        assert_allclose(contact.jacobian @ velocity, material.difference(before) / (2.0 * STEP), atol=1e-6)


def update(group: Handler | list[Point]) -> None:
    if isinstance(group, Handler):
        group.update()
        assert_allclose(group.value, np.concatenate([point.value for point in group]))
        for point in group:
            assert np.shares_memory(point.jacobian, group.jacobian)
    else:
        for point in group:
            point.update()
