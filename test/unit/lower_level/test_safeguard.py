"""A lower level holds when its robot has fallen, or a joint is out of control."""

import numpy as np
import pytest
from support.unit.cart import DT, GAINS, GROUPS, RECORDS, URDF, bend, claim, make, turn

from solfer.config import read
from solfer.errors import ConfigError, Suspended
from solfer.lower_level import build_lower_level
from solfer.lower_level.safeguard.overspeed import Overspeed
from solfer.model import Description, Kinematics
from solfer.simulation.bundle_records import BundleRecord

ROLL, SHOULDER = 6, 7  # DoFs of the cart, with limits of 3 and 10 rad/s


def tilted(degrees, about="rx", yaw=0.0):
    """Return a position in which the base is tilted."""
    q = np.zeros(8)
    q[{"rx": 3, "ry": 4}[about]], q[5] = np.radians(degrees), yaw
    return q


def moving(**speeds):
    """Return velocities with these speeds of the joints [rad/s]."""
    v = np.zeros(8)
    v[SHOULDER], v[ROLL] = speeds.get("shoulder", 0.0), speeds.get("roll", 0.0)
    return v


def update(cart, duration, q=None, v=None):
    """Let time [s] pass at one position and speed."""
    q, v = np.zeros(8) if q is None else q, np.zeros(8) if v is None else v
    for _ in range(round(duration / DT)):
        cart.update(q, v, DT)


@pytest.fixture
def cart():
    """Make a cart that a plugin commands."""
    made = make(lease=100.0)
    turn(made, "/plugin", 2.0)
    bend(made, "/plugin", position=0.5, effort=3.0, stiffness=0.0)
    return made


@pytest.mark.parametrize("about", ["rx", "ry"])
def test_a_fallen_cart_holds_its_position(cart, about):
    wheel, arm = cart.controllers["wheel"], cart.controllers["arm"]
    q = tilted(61.0, about, yaw=1.0)
    q[SHOULDER] = 0.7
    update(cart, 0.499, q)
    assert wheel.velocity[0] == 2.0 and not cart.safeguard.reason
    update(cart, 0.003, q)
    assert wheel.velocity[0] == 0.0 and cart.claims.owners() == ()
    assert (arm.position[0], arm.target[0], arm.effort[0], arm.stiffness[0]) == (0.7, 0.7, 0.0, 200.0)
    for attempt in (lambda: turn(cart, "/other"), lambda: claim(cart, "/other", ("arm",))):
        with pytest.raises(Suspended, match="fallen.* 61 degrees, beyond 60 degrees\n.*stands upright"):
            attempt()
    assert cart.starts == 1  # plugins hold, they do not forget


def test_a_short_or_small_tilt_is_ignored(cart):
    for _ in range(2):
        update(cart, 0.4, tilted(80.0))
        update(cart, 0.01, tilted(59.0))
    update(cart, 0.6, tilted(59.0, "ry"))
    assert not cart.safeguard.reason and cart.claims.owners() == ("/plugin",)


def test_an_upright_cart_needs_a_new_claim(cart):
    update(cart, 0.6, tilted(90.0))
    update(cart, 0.6, tilted(50.0))  # it is still tilted
    assert cart.safeguard.reason
    update(cart, 0.49, tilted(45.0))
    assert cart.safeguard.reason
    update(cart, 0.02, tilted(45.0))
    assert not cart.safeguard.reason
    assert cart.controllers["wheel"].velocity[0] == 0.0 and cart.controllers["arm"].position[0] == 0.0
    claim(cart, "/plugin", ("wheel",))
    turn(cart, "/plugin", 1.0)
    assert cart.controllers["wheel"].velocity[0] == 1.0


def test_another_state_ends_the_hold_at_once(cart):
    update(cart, 0.6, tilted(90.0))
    cart.emergency_stop("by hand")
    cart.reset_emergency_stop()
    with pytest.raises(Suspended, match="fallen"):
        claim(cart, "/plugin", ("wheel",))
    cart.start(np.zeros(8))
    claim(cart, "/plugin", ("wheel",))


def test_the_tilt_includes_the_base_joints_origin():
    turned = URDF.replace('<child link="base"/></joint>', '<child link="base"/><origin rpy="0 1.5708 0"/></joint>')
    cart = build_lower_level(Kinematics(Description.from_text(turned)), RECORDS, GROUPS, GAINS)
    cart.start(tilted(-90.0, "ry"))
    assert not cart.safeguard.reason
    cart.start(tilted(-90.0, "rx"))
    assert "90 degrees" in cart.safeguard.reason


def test_a_new_beginning_forgets_how_long_it_tilted(cart):
    update(cart, 0.4, tilted(61.0))
    cart.start(np.zeros(8))
    update(cart, 0.4, tilted(61.0))
    assert not cart.safeguard.reason
    update(cart, 0.2, tilted(61.0))
    assert cart.safeguard.reason


def test_only_one_step_finds_a_joint_too_fast():
    overspeed = Overspeed(Kinematics(Description.from_text(URDF)), 2.0, 0.0505)
    found = [overspeed.advance(moving(shoulder=6.5), DT) for _ in range(52)]
    assert found == [False] * 50 + [True, False] and "'shoulder'" in overspeed.reason


@pytest.mark.parametrize(
    ("speeds", "named"),
    [
        ({"shoulder": 6.5}, "'shoulder' moved at 6.5 rad/s, beyond 2 times its limit of 3"),
        ({"roll": -21.0}, "'roll' moved at 21 rad/s, beyond 2 times its limit of 10"),
    ],
)
def test_a_joint_out_of_control_ends_claims(cart, speeds, named):
    update(cart, 0.049, v=moving(**speeds))
    assert cart.controllers["wheel"].velocity[0] == 2.0
    update(cart, 0.003, v=moving(**speeds))
    assert cart.controllers["wheel"].velocity[0] == 0.0 and cart.controllers["arm"].effort[0] == 0.0
    with pytest.raises(Suspended, match=named):
        turn(cart, "/other")
    update(cart, 0.5, v=moving(shoulder=3.1))  # slower, but beyond the limit itself
    assert named in cart.safeguard.reason
    update(cart, 0.11, v=moving(shoulder=2.9, roll=9.0))
    claim(cart, "/plugin", ("wheel",))


def test_a_swing_counts_but_a_blow_does_not(cart):
    for _ in range(10):
        update(cart, 0.03, v=moving(shoulder=60.0))
        update(cart, 0.03)
    assert not cart.safeguard.reason
    for _ in range(30):  # as an unstable law does, with its slow moments
        for speed in (8.0, 8.0, 1.0, -8.0, -8.0, -1.0):
            update(cart, DT, v=moving(shoulder=speed))
    assert "'shoulder'" in cart.safeguard.reason


def test_a_fall_keeps_the_earlier_reason(cart):
    update(cart, 0.06, tilted(70.0), moving(roll=30.0))
    update(cart, 0.4, tilted(80.0))
    assert "'roll'" in cart.safeguard.reason
    update(cart, 0.1, tilted(80.0))
    assert "fallen" in cart.safeguard.reason


@pytest.mark.parametrize("limit", ["", '<limit velocity="0" effort="40"/>'])
def test_joints_without_a_limit_may_be_fast(limit):
    urdf = URDF.replace('<limit velocity="10" effort="20"/>', limit)
    cart = build_lower_level(Kinematics(Description.from_text(urdf)), RECORDS, GROUPS, GAINS)
    cart.start(np.zeros(8))
    update(cart, 0.5, v=moving(roll=500.0))
    assert not cart.safeguard.reason


def test_both_bounds_can_be_disabled_and_set():
    cart = make(tilt=0.0, overspeed=0.0)
    update(cart, 0.6, tilted(120.0), moving(roll=1e3))
    assert not cart.safeguard.reason
    cart = make(tilt=0.5, tilt_time=0.1, overspeed=1.5, overspeed_time=0.0)
    update(cart, 0.102, tilted(29.0))
    assert "29 degrees, beyond 29 degrees" in cart.safeguard.reason
    update(cart, DT, v=moving(roll=15.1))
    cart.start(np.zeros(8))
    update(cart, DT, v=moving(roll=15.1))
    assert "'roll'" in cart.safeguard.reason


@pytest.mark.parametrize("tag", ["tilt: 4", "overspeed: 0.5", "tilt: .inf"])
def test_wrong_bounds_are_named_with_their_place(tmp_path, tag):
    file = tmp_path / "robot.yaml"
    file.write_text(f"name: a\nurdf: a.urdf\nlower_level:\n  {tag}\n")
    with pytest.raises(ConfigError, match=f"robot.yaml:[34]:.*{tag.split(':')[0]}"):
        read(file, BundleRecord)
