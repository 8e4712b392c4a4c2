"""Claims on joints: granted whole or refused with both names, and ended by silence in the lower level's own time."""

import numpy as np
import pytest
from cart import advance, bend, claim, make, turn

from solfer.errors import ClaimRefused, CommandRefused, UnknownName


@pytest.fixture
def lower_level():
    """With the normal lease of 0.3 s."""
    return make()


def test_the_second_one_is_refused_with_both_names_and_moves_nothing(lower_level):
    turn(lower_level, "/first")
    with pytest.raises(ClaimRefused) as refusal:
        turn(lower_level, "/second", -2.0)
    for text in ("'/first'", "'/second'", "roll", "'wheel'"):
        assert text in str(refusal.value)
    assert lower_level.controllers["wheel"].velocity[0] == 1.0
    turn(lower_level, "/first", 1.5)
    assert lower_level.controllers["wheel"].velocity[0] == 1.5
    assert dict(lower_level.refusals) == {"/second": 1} and lower_level.refused == 1


def test_disjoint_claims_live_side_by_side(lower_level):
    turn(lower_level, "/driver")
    bend(lower_level, "/arm", position=0.1)
    bend(lower_level, "/torque", effort=1.0)
    with pytest.raises(ClaimRefused, match="'/torque' cannot command shoulder"):
        bend(lower_level, "/torque", position=0.2, effort=2.0)
    assert lower_level.controllers["arm"].effort[0] == 1.0
    assert lower_level.claims.describe("arm") == "/arm: position; /torque: effort"
    assert lower_level.claims.describe("wheel") == "/driver: velocity"


def test_silence_ends_a_claim_in_the_time_of_the_lower_level(lower_level):
    turn(lower_level, "/first")
    bend(lower_level, "/first", position=0.3, effort=4.0, stiffness=50.0)
    advance(lower_level, 0.299)
    assert lower_level.controllers["wheel"].velocity[0] == 1.0
    with pytest.raises(ClaimRefused):  # nothing ages while the lower level stands still, however long that takes
        turn(lower_level, "/second")
    advance(lower_level, 0.002)
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    arm = lower_level.controllers["arm"]
    assert (arm.position[0], arm.effort[0], arm.stiffness[0]) == (0.3, 4.0, 50.0)
    turn(lower_level, "/second")


def test_every_accepted_command_renews_all_that_its_sender_has_and_a_refused_one_nothing(lower_level):
    claim(lower_level, "/walker", ("arm", "wheel"))
    for _ in range(10):
        advance(lower_level, 0.1)
        bend(lower_level, "/walker", position=0.1)
    with pytest.raises(ClaimRefused):
        turn(lower_level, "/second")
    for _ in range(4):
        advance(lower_level, 0.1)
        with pytest.raises(CommandRefused, match="not a finite number"):
            bend(lower_level, "/walker", position=np.nan)
    turn(lower_level, "/second")


def test_a_claim_is_granted_whole_or_not_at_all(lower_level):
    turn(lower_level, "/first")
    with pytest.raises(ClaimRefused, match="'/second' cannot command roll of controller 'wheel': '/first' does"):
        claim(lower_level, "/second", ("arm", "wheel"))
    bend(lower_level, "/third", position=0.1)
    claim(lower_level, "/fourth", ("arm",), ("stiffness",), ("shoulder",))
    assert lower_level.claims.describe("arm") == "/third: position; /fourth: stiffness"


@pytest.mark.parametrize(("arguments", "error", "text"), [
    (("", ("arm",)), CommandRefused, "without an owner"),
    (("/a", ()), CommandRefused, "without controllers"),
    (("/a", ("arms",)), UnknownName, "did you mean: arm"),
    (("/a", ("arm",), ("positions",)), UnknownName, "did you mean: position"),
    (("/a", ("wheel",), ("effort",)), CommandRefused, "does not take 'effort'"),
    (("/a", ("arm",), ("position", "effort")), CommandRefused, "2 modes for 1 controllers"),
    (("/a", ("arm",), (), ("sholder",)), UnknownName, "did you mean: shoulder"),
])
def test_a_wrong_claim_is_refused(lower_level, arguments, error, text):
    with pytest.raises(error) as refusal:
        claim(lower_level, *arguments)
    assert text in str(refusal.value)
    assert lower_level.claims.owners() == ()


def test_a_release_stops_wheels_frees_joints_and_refuses_what_comes_late(lower_level):
    turn(lower_level, "/first")
    lower_level.release("/first")
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    with pytest.raises(CommandRefused, match="'/first' are not accepted: it has released"):
        turn(lower_level, "/first")
    turn(lower_level, "/second")
    lower_level.release("/second")
    claim(lower_level, "/second", ("wheel",))
    turn(lower_level, "/second")
    lower_level.release("/nobody")


def test_who_was_silent_for_a_lease_may_command_again_after_a_release(lower_level):
    turn(lower_level, "/first")
    lower_level.release("/first")
    for _ in range(5):
        advance(lower_level, 0.2)
        with pytest.raises(CommandRefused):
            turn(lower_level, "/first")
    advance(lower_level, 0.301)
    turn(lower_level, "/first")


@pytest.mark.parametrize("silence", ["keep", "hold", "stop", "damp"])
def test_what_silence_does_is_configured(silence):
    lower_level = make(lease=0.1, silence=silence)
    turn(lower_level, "/first")
    advance(lower_level, 0.102)
    assert lower_level.controllers["wheel"].velocity[0] == (1.0 if silence == "keep" else 0.0)
    assert bool(lower_level.emergency) == (silence == "damp")
    advance(lower_level, 0.5)
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    if silence in ("keep", "hold"):
        turn(lower_level, "/first")
    else:
        with pytest.raises(CommandRefused, match="fallen silent"):
            turn(lower_level, "/first")
    if silence == "stop":
        claim(lower_level, "/first", ("wheel",))
        turn(lower_level, "/first")


def test_refusals_of_many_senders_are_counted_in_bounded_memory(lower_level):
    for number in range(500):
        with pytest.raises(CommandRefused):
            turn(lower_level, f"/hostile_{number}", np.inf)
    assert lower_level.refused == 500 and len(lower_level.refusals) < 100


def test_a_command_that_repeats_itself_is_not_compared_joint_by_joint(lower_level, monkeypatch):
    turn(lower_level, "/first")
    monkeypatch.setattr(lower_level.claims, "take", None)
    turn(lower_level, "/first", 2.0)
    assert lower_level.controllers["wheel"].velocity[0] == 2.0
