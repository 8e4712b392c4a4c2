"""What points refuse: points that do not go together, sizes that do not fit, and what has no meaning."""

import copy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.random_states import load
from support.unit.refusals import check_refusal

from solfer.errors import NotFinite, PointError, SizeMismatch
from solfer.model.contacts import read_contacts
from solfer.points import (
    POSE,
    CenterOfPressure,
    Constant,
    FrameOrientation,
    GroundFrame,
    Handler,
    LinearAcceleration,
    LinearPoint,
    LookAt,
    Minus,
    Norm,
    Plus,
    PointContact,
    RelativePoint,
    SpatialPoint,
    SupportVertex,
    make_contact,
)
from solfer.points.space import ORIENTATION

CONTACTS = Path(__file__).parents[3] / "config/robots/centauro/contacts.yaml"
WHEEL = next(record for record in read_contacts(CONTACTS, "centauro") if record.type == "wheel")


@pytest.fixture(scope="module")
def given():
    """Make points of a robot, and one of another Robot."""
    robot = load("centauro")[0]
    return SimpleNamespace(
        robot=robot,
        hand=LinearPoint("arm1_7", robot),
        turn=FrameOrientation("arm1_7", robot),
        pose=SpatialPoint("pelvis", robot),
        sensed=LinearAcceleration("arm1_7", robot),
        contact=PointContact("arm1_7", robot),
        foreign=LinearPoint("arm2_7", load("centauro")[0]),
    )


def touching(given):
    """Make a contact of the other Robot."""
    return PointContact("arm1_7", given.foreign.robot)


BOTH = "belongs to another Robot ('centauro') than"
REFUSED = [
    (lambda g: Plus((1.0,), (2.0,)), PointError, "Plus of numbers alone"),
    (lambda g: Minus(3.0, 4.0), PointError, "Minus of numbers alone"),
    (lambda g: Plus(g.hand, g.sensed), PointError, "would have no offset"),
    (lambda g: Plus(g.hand, g.turn), SizeMismatch, "Plus of LinearPoint"),
    (lambda g: g.turn + g.turn, PointError, "cannot be added (expected: vectors"),
    (lambda g: g.turn.__iadd__(g.turn), PointError, "'+=' has no meaning for FrameOrientation"),
    (lambda g: Norm(g.turn), PointError, "has no norm (expected: a vector"),
    (lambda g: copy.copy(g.hand), PointError, "cannot be copied"),
    (lambda g: g.hand - g.foreign, PointError, BOTH),
    (lambda g: g.hand.difference(g.foreign), PointError, BOTH),
    (lambda g: g.hand.assign(g.foreign), PointError, BOTH),
    (lambda g: Handler([g.hand, g.foreign]), PointError, BOTH),
    (lambda g: CenterOfPressure([g.contact, touching(g)]), PointError, BOTH),
    (lambda g: Handler([])[0], PointError, "no point 0 in a Handler of 0 (expected: a Handler with points"),
    (lambda g: g.hand - g.turn, SizeMismatch, "3 numbers"),
    (lambda g: g.hand - Constant(4), SizeMismatch, "3 numbers"),
    (lambda g: g.hand.difference(g.turn), SizeMismatch, "difference of LinearPoint"),
    (lambda g: g.hand.assign(g.turn), SizeMismatch, "assignment of LinearPoint"),
    (lambda g: g.hand.difference(Constant(6)), SizeMismatch, "6 numbers"),
    (lambda g: g.hand.difference((1.0, 2.0)), SizeMismatch, "needs 3 numbers, got shape (2,)"),
    (lambda g: g.hand.__iadd__((1.0, 2.0)), SizeMismatch, "'+='"),
    (lambda g: Constant(3).set((1.0, 2.0)), SizeMismatch, "(2,)"),
    (lambda g: Minus(g.hand, g.hand.value).second.set(np.zeros((2, 48))), SizeMismatch, "(2, 48)"),
    (lambda g: Constant(3, ORIENTATION), SizeMismatch, "3"),
    (lambda g: GroundFrame(g.hand), SizeMismatch, "GroundFrame at LinearPoint"),
    (lambda g: GroundFrame(g.pose, axis=(0.0, 0.0, 0.0)), NotFinite, "a vector of zeros has no direction"),
    (lambda g: LookAt(g.hand, g.pose), SizeMismatch, "(expected: a pose, and a position"),
    (lambda g: RelativePoint(g.hand, g.hand), SizeMismatch, "as seen from LinearPoint"),
    (lambda g: RelativePoint(Constant(3), Constant(POSE.neutral(), POSE)), PointError, "belongs to no Robot"),
    (lambda g: SupportVertex("wheel_1", g.robot, -0.1, 0.2), PointError, "'wheel_1' has the radii -0.1 and 0.2"),
    (lambda g: CenterOfPressure([]).contacts, PointError, "a centre of pressure of no contact"),
    (lambda g: CenterOfPressure([g.hand]).contacts, PointError, "a centre of pressure of LinearPoint"),
]


@pytest.mark.parametrize(("call", "error", "words"), REFUSED, ids=[words for *_, words in REFUSED])
def test_what_has_no_meaning_is_refused(given, call, error, words):
    check_refusal(lambda: call(given), error, "", words)


def test_a_wheel_that_is_not_described_is_refused(given):
    vague = WHEEL.model_copy(update={"minor_axis": None})
    words = f"wheel '{WHEEL.name}' is not described (expected: minor_axis, major_axis"
    check_refusal(lambda: make_contact(vague, given.robot), PointError, WHEEL.where("end_frame"), words)
