"""Claims on joints: granted whole or refused with both names, and ended by a timeout in the lower level's own time."""

import numpy as np
import pytest
from support.unit.cart import advance, bend, claim, make, turn

from solfer.errors import ClaimRefused, CommandRefused
from solfer.lower_level.claims.claims import ClaimedJoints, Claims
from solfer.transport.lower_level import claimant, node_of


@pytest.fixture
def lower_level():
    """Make a lower level with the default lease of 0.3 s."""
    return make()


def test_a_second_sender_is_refused_with_both_names(lower_level):
    turn(lower_level, "/first")
    with pytest.raises(ClaimRefused) as refusal:
        turn(lower_level, "/second", -2.0)
    for text in ("'/first'", "'/second'", "roll", "'wheel'"):
        assert text in str(refusal.value)
    assert lower_level.controllers["wheel"].velocity[0] == 1.0
    turn(lower_level, "/first", 1.5)
    assert lower_level.controllers["wheel"].velocity[0] == 1.5
    assert dict(lower_level.refusals) == {"/second": 1} and lower_level.refused == 1


@pytest.mark.parametrize(("count", "shown"), [(6, "a, b, c, d, e, f"), (7, "a, b, c, d, e, f and 1 more")])
def test_a_refusal_shows_six_joints(count, shown):
    claims = Claims({"arm": tuple("abcdefg")}, 0.3)
    claims.claim("/first", [ClaimedJoints("arm", np.arange(count), ("position",))])
    with pytest.raises(ClaimRefused) as refusal:
        claims.claim("/second", [ClaimedJoints("arm", np.arange(7), ("position",))])
    assert refusal.value.what == f"'/second' cannot command {shown} of controller 'arm': '/first' does"


def test_disjoint_claims_live_side_by_side(lower_level):
    turn(lower_level, "/driver")
    bend(lower_level, "/arm", position=0.1)
    bend(lower_level, "/torque", effort=1.0)
    with pytest.raises(ClaimRefused, match="'/torque' cannot command shoulder"):
        bend(lower_level, "/torque", position=0.2, effort=2.0)
    assert lower_level.controllers["arm"].effort[0] == 1.0
    assert lower_level.claims.describe("arm") == "/arm: position; /torque: effort"
    assert lower_level.claims.describe("wheel") == "/driver: velocity"


def test_a_lease_ends_in_the_lower_levels_time(lower_level):
    turn(lower_level, "/first")
    bend(lower_level, "/first", position=0.3, effort=4.0, stiffness=50.0)
    advance(lower_level, 0.299)
    assert lower_level.controllers["wheel"].velocity[0] == 1.0
    with pytest.raises(ClaimRefused):  # nothing ages while the lower level stands still, however long that takes
        turn(lower_level, "/second")
    arm = lower_level.controllers["arm"]
    pull = arm.stiffness[0] * arm.target[0]
    assert arm.stiffness[0] == 50.0 and pull > 1.0
    advance(lower_level, 0.002)
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    assert arm.position[0] == arm.target[0] == pytest.approx(pull / 200.0, rel=0.01)
    assert (arm.effort[0], arm.stiffness[0]) == (4.0, 200.0)
    turn(lower_level, "/second")


def test_only_accepted_commands_renew_a_lease(lower_level):
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


def test_a_claim_is_granted_whole_or_not(lower_level):
    turn(lower_level, "/first")
    with pytest.raises(ClaimRefused, match="'/second' cannot command roll of controller 'wheel': '/first' does"):
        claim(lower_level, "/second", ("arm", "wheel"))
    bend(lower_level, "/third", position=0.1)
    claim(lower_level, "/fourth", ("arm",), ("stiffness",), ("shoulder",))
    assert lower_level.claims.describe("arm") == "/third: position; /fourth: stiffness"


def test_a_release_frees_joints_and_refuses_late_commands(lower_level):
    turn(lower_level, "/first")
    lower_level.release("/first")
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    with pytest.raises(CommandRefused, match="'/first' are not accepted: it has released"):
        turn(lower_level, "/first")
    turn(lower_level, "/second")
    lower_level.release("/second")
    claim(lower_level, "/second", ("wheel",))
    turn(lower_level, "/second")
    lower_level.release("/unknown")


def test_no_bar_ends_by_time(lower_level):
    """A process that stood still goes on with earlier commands: it has to claim."""
    turn(lower_level, "/first")
    lower_level.release("/first")
    advance(lower_level, 1.0)
    with pytest.raises(CommandRefused, match="it has released"):
        turn(lower_level, "/first")
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    claim(lower_level, "/first", ("wheel",))
    turn(lower_level, "/first")


@pytest.mark.parametrize("claims", [False, True])
@pytest.mark.parametrize("silence", ["keep", "hold", "stop", "damp"])
def test_the_action_after_a_lease_is_configured(silence, claims):
    """An owner that had claimed has to claim again in any case; one that just commanded, for some actions."""
    lower_level = make(lease=0.1, silence=silence)
    if claims:
        claim(lower_level, "/first", ("wheel",))
    turn(lower_level, "/first")
    advance(lower_level, 0.102)
    assert lower_level.controllers["wheel"].velocity[0] == (1.0 if silence == "keep" else 0.0)
    assert bool(lower_level.emergency) == (silence == "damp")
    advance(lower_level, 0.5)
    assert lower_level.controllers["wheel"].velocity[0] == 0.0
    if silence in ("keep", "hold") and not claims:
        return turn(lower_level, "/first")
    with pytest.raises(CommandRefused, match="timed out"):
        turn(lower_level, "/first")
    if silence != "damp":
        claim(lower_level, "/first", ("wheel",))
        turn(lower_level, "/first")


def test_a_long_start_does_not_cost_the_joints(lower_level):
    """A component's `init` may block; there is no earlier command that could go on."""
    claim(lower_level, "/first", ("wheel",))
    advance(lower_level, 1.0)
    turn(lower_level, "/first")
    assert lower_level.controllers["wheel"].velocity[0] == 1.0


def test_the_end_of_a_lease_leaves_the_other(lower_level):
    claim(lower_level, "/driver", ("wheel",))
    claim(lower_level, "/arm", ("arm",), ("position",))
    for _ in range(4):
        turn(lower_level, "/driver")
        advance(lower_level, 0.1)
    assert lower_level.claims.owners() == ("/driver",)
    assert lower_level.controllers["wheel"].velocity[0] == 1.0


def test_a_repeated_claim_renews_the_lease(lower_level):
    for _ in range(4):
        claim(lower_level, "/first", ("wheel",))
        advance(lower_level, 0.2)
    assert lower_level.claims.owners() == ("/first",)


def test_a_first_command_far_away_is_logged(lower_level, caplog):
    bend(lower_level, "/near", position=0.04)
    lower_level.release("/near")
    assert not caplog.text
    bend(lower_level, "/far", position=1.0)
    assert "'/far' begins 1.000 away from where joint 'shoulder' is held" in caplog.text


def test_refusals_are_counted_in_bounded_memory(lower_level):
    for number in range(500):
        with pytest.raises(CommandRefused):
            turn(lower_level, f"/hostile_{number}", np.inf)
    assert lower_level.refused == 500 and len(lower_level.refusals) < 100


def test_a_repeated_command_is_not_compared_by_joint(lower_level, monkeypatch):
    turn(lower_level, "/first")
    monkeypatch.setattr(lower_level.claims, "claim_by_command", None)
    turn(lower_level, "/first", 2.0)
    assert lower_level.controllers["wheel"].velocity[0] == 2.0


def test_each_component_of_a_node_is_a_claimant(lower_level):
    turn(lower_level, "/limbs", component="drives")
    bend(lower_level, "/limbs", component="springs", position=0.1)
    with pytest.raises(ClaimRefused, match="'/limbs#springs' cannot command roll .* '/limbs#drives' does"):
        turn(lower_level, "/limbs", 2.0, "springs")
    with pytest.raises(ClaimRefused, match="'/limbs' cannot command roll .* '/limbs#drives' does"):
        turn(lower_level, "/limbs", 2.0)
    assert lower_level.claims.owners() == ("/limbs#drives", "/limbs#springs")
    assert dict(lower_level.refusals) == {"/limbs#springs": 1, "/limbs": 1}
    lower_level.release("/limbs#springs")
    assert lower_level.claims.describe("wheel") == "/limbs#drives: velocity"
    assert lower_level.controllers["wheel"].velocity[0] == 1.0
    with pytest.raises(CommandRefused, match="'/limbs#springs' are not accepted: it has released"):
        bend(lower_level, "/limbs", component="springs", position=0.1)
    turn(lower_level, "/limbs", 1.5, "drives")


def test_each_component_renews_its_own_lease(lower_level):
    claim(lower_level, "/limbs#drives", ("wheel",))
    claim(lower_level, "/limbs#springs", ("arm",))
    for _ in range(4):
        bend(lower_level, "/limbs", component="springs", position=0.1)
        advance(lower_level, 0.1)
    assert lower_level.claims.owners() == ("/limbs#springs",) and "/limbs" in lower_level.claims.nodes
    lower_level.release("/limbs#springs")
    assert "/limbs" not in lower_level.claims.nodes


@pytest.mark.parametrize(
    ("node", "component", "name"),
    [
        ("/limbs", "drives", "/limbs#drives"),
        ("/robot/limbs", "limbs", "/robot/limbs"),  # the only one of its node, as a rule
        ("/limbs", "", "/limbs"),
        ("", "", ""),
    ],
)
def test_a_claimant_is_named_after_its_node(node, component, name):
    assert claimant(node, component) == name and node_of(name) == node
