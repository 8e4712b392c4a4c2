"""What points say where they do not go together, word for word."""

import copy
from pathlib import Path

import numpy as np
import pytest
from support.unit.random_states import load

from solfer.errors import SolferError
from solfer.model.contacts import read_contacts
from solfer.points import (
    CenterOfMass,
    CenterOfPressure,
    Constant,
    FrameOrientation,
    GroundFrame,
    Handler,
    LinearAcceleration,
    LinearPoint,
    LookAt,
    Norm,
    Plus,
    PointContact,
    RelativePoint,
    SpatialPoint,
    SupportVertex,
    make_contact,
)

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"


@pytest.fixture(scope="module")
def robot():
    return load("centauro")[0]


@pytest.fixture(scope="module")
def other():
    return load("centauro")[0]


@pytest.fixture
def hand(robot):
    return LinearPoint("arm1_7", robot)


def refusal(call):
    with pytest.raises(SolferError) as error:
        call()
    return error.value.what, error.value.expected


def test_pairs_say_why_they_do_not_fit(robot, hand):
    """Each text has what was wrong and what would be right: sums, norms, differences, assignments, copies."""
    turn, sensed = FrameOrientation("arm1_7", robot), LinearAcceleration("arm1_7", robot)
    vectors = "vectors; a Minus of two orientations is one"
    assert refusal(lambda: Plus((1.0,), (2.0,))) == ("Plus of numbers alone", "at least one point")
    assert refusal(lambda: Plus(hand, sensed)) == (
        f"Plus of {sensed} would have no offset",
        "plus(first, second), which makes dynamic points of dynamic ones",
    )
    assert refusal(lambda: Plus(hand, turn)) == (
        f"Plus of {hand} and {turn}",
        "two of one space; Constant.like(point) makes a reference for any point",
    )
    assert refusal(lambda: turn + turn) == (f"{turn} cannot be added", vectors)
    assert refusal(lambda: Norm(turn)) == (f"{turn} has no norm", "a vector; a Minus of two orientations is one")
    assert refusal(lambda: turn.__iadd__(turn)) == (f"'+=' has no meaning for {turn}", vectors)
    assert refusal(lambda: hand.difference(turn)) == (f"difference of {hand} and {turn}", "")
    assert refusal(lambda: hand.assign(turn)) == (f"assignment of {hand} and {turn}", "")
    assert refusal(lambda: hand.difference((1.0,))) == (f"a difference from {hand} needs 3 numbers, got shape (1,)", "")
    assert refusal(lambda: copy.copy(hand)) == (
        f"{hand} cannot be copied",
        "a new point, or Constant.like(point) for its value",
    )


def test_points_of_two_robots_name_both(robot, other, hand):
    foreign = LinearPoint("arm2_7", other)
    what = f"{foreign} belongs to another Robot ('{other.name}') than {hand} ('{robot.name}')"
    for call in (lambda: hand - foreign, lambda: Handler([hand, foreign]), lambda: hand.assign(foreign)):
        assert refusal(call) == (what, "points of one Robot object")


def test_a_handler_says_what_it_refuses(hand, robot):
    handler = Handler([hand])
    assert refusal(lambda: handler.add("hand")) == ("a Handler holds points, got str", "a Point")
    assert refusal(lambda: handler.add(hand)) == (f"{hand} is in this Handler already", "each point once")
    assert refusal(lambda: handler[1]) == ("there is no point 1 in a Handler of 1", "an index from -1 to 0")
    assert refusal(lambda: Handler([])[0]) == ("there is no point 0 in a Handler of 0", "a Handler with points")
    fresh = CenterOfMass(robot)
    assert refusal(lambda: handler.__setitem__(0, fresh)) == (
        f"{hand} is not replaced by {fresh}",
        "assign() to copy its numbers, or remove() and add()",
    )
    assert refusal(lambda: handler.remove(fresh)) == (
        f"{fresh} is not in this Handler",
        "a point that was added to it",
    )


def test_frames_say_what_they_need(robot, hand):
    """Frames need poses, directions and a Robot: the error names the points, and what to pass instead."""
    pose = SpatialPoint("pelvis", robot)
    assert refusal(lambda: GroundFrame(hand)) == (f"GroundFrame at {hand}", "a pose")
    assert refusal(lambda: GroundFrame(pose, axis=(0.0, 0.0, 0.0))) == (
        "axis of a GroundFrame: a vector of zeros has no direction",
        "a vector that is not zero",
    )
    assert refusal(lambda: LookAt(hand, pose)) == (
        f"a direction from {hand} to {pose}",
        "a pose, and a position",
    )
    assert refusal(lambda: RelativePoint(hand, hand)) == (
        f"{hand} as seen from {hand}",
        "a position, an orientation or a pose, as seen from a pose",
    )
    still = Constant(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), pose.space)
    assert refusal(lambda: RelativePoint(Constant(3), still)) == (
        f"{Constant(3)} belongs to no Robot",
        "at least one point of a Robot",
    )


def test_contacts_say_what_is_missing(robot, hand):
    """Malformed constraints, radii, foreign points and an incomplete record of a wheel, each with its remedy."""
    rows = "one to six rows of 6"
    contact = PointContact("arm1_7", robot)
    shapes = {(7, 6), (1, 5), (0, 6)}
    for shape in shapes:
        what, expected = refusal(lambda shape=shape: PointContact("arm1_7", robot, constraint=np.ones(shape)))
        assert (what, expected) == (f"{contact} with a constraint of shape {shape}", rows)
    assert refusal(lambda: PointContact("arm1_7", robot, constraint=np.zeros((1, 6)))) == (
        f"{contact} with the constraint [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]",
        "finite rows that are not zero",
    )
    assert refusal(lambda: SupportVertex("wheel_1", robot, -0.1, 0.2)) == (
        "wheel 'wheel_1' has the radii -0.1 and 0.2",
        "radii that are not negative",
    )
    contacts = "PointContacts or RollingContacts"
    assert refusal(lambda: CenterOfPressure([]).contacts) == ("a centre of pressure of no contact", contacts)
    assert refusal(lambda: CenterOfPressure([hand]).contacts) == (f"a centre of pressure of {hand}", contacts)
    wheel = next(record for record in read_contacts(CENTAURO / "contacts.yaml", "centauro") if record.type == "wheel")
    vague = wheel.model_copy(update={"minor_axis": None})
    assert refusal(lambda: make_contact(vague, robot)) == (
        f"wheel '{wheel.name}' is not described",
        "minor_axis, major_axis and reference_axis",
    )
