"""Services of the lower level: list, switch, feed-forward torque, gains, and the emergency stop."""

import dataclasses
import math

import numpy as np
import pytest
from support.unit.cart import DT, advance, bend, claim, make, turn

from solfer.errors import CommandRefused, ConfigError, SolferError, UnknownName
from solfer.lower_level.gains.ramp import COMMANDED_DURATION
from solfer.lower_level.server.services import controller_services, lower_level_services
from solfer.transport.lower_level import ClaimRequest, FileRequest, ReleaseRequest
from solfer.transport.middleware import Flag, NoFields, SwitchRequest


@pytest.fixture
def lower_level():
    """Make a cart with an arm and a wheel."""
    return make()


def ask(lower_level, name, request=None):
    """Call a service of the lower level."""
    services = {service.name: service for service in lower_level_services(lower_level)}
    return services[name].prepared(request or NoFields())()


def ask_arm(lower_level, name, request):
    """Call a service of the arm's controller."""
    offered = controller_services(lower_level.controller("arm"), lower_level.folders)
    services = {service.name: service for service in offered}
    return services[name].prepared(request)()


def torque(lower_level, q=None):
    """Compute the arm's torque after one more step at position q [Nm]."""
    arm = lower_level.controllers["arm"].dofs[0]
    return lower_level.update(np.zeros(8) if q is None else q, np.zeros(8), DT)[0][arm]


def test_the_list_of_controllers_is_complete(lower_level):
    ask(lower_level, "claim", ClaimRequest("/walker", ("arm", "arm", "wheel"), ("position", "effort", "velocity")))
    ask(lower_level, "switch", SwitchRequest(stop=("wheel",)))
    published = ask(lower_level, "list_controllers")
    assert (published.names, published.types) == (("arm", "wheel"), ("impedance", "velocity"))
    assert (published.joints, published.states) == (("shoulder", "roll"), ("running", "stopped"))
    assert published.claimed_by == ("/walker: position, effort", "")
    ask(lower_level, "release", ReleaseRequest("/walker"))
    assert ask(lower_level, "list_controllers").claimed_by == ("", "")


@pytest.mark.parametrize(
    ("measured", "modes", "refused"),
    [
        (0.1, ("position",), False),
        (0.34, ("position",), False),  # held at 0.1: 40 Nm of 200 Nm/rad, and 0.05 rad
        (0.36, ("position",), True),
        (-0.16, ("position",), True),
        (0.36, ("effort",), False),
        (math.nan, ("position",), False),
    ],
)
def test_a_joint_that_its_spring_cannot_reach_is_not_claimed(lower_level, measured, modes, refused):
    position = np.zeros(8)
    position[lower_level.controllers["arm"].dofs] = 0.1
    lower_level.start(position)
    request = ClaimRequest("/walker", ("arm",), modes, ("shoulder",), positions=(measured,))
    answer = ask(lower_level, "claim", request)
    assert (answer.success, answer.later, bool(lower_level.claims.owners())) == (not refused, refused, not refused)
    if refused:
        for part in (f"'shoulder' is measured at {measured:.3f}", "'arm' holds it at 0.100", "by 0.200 at most"):
            assert part in answer.message


def test_efforts_stretch_springs_and_free_joints_have_none(lower_level):
    bend(lower_level, "/walker", effort=20.0)
    advance(lower_level, 0.01)
    request = ClaimRequest("/walker", ("arm",), ("position",), ("shoulder",), positions=(0.34,))
    assert ask(lower_level, "claim", request).success
    assert not ask(lower_level, "claim", dataclasses.replace(request, positions=(0.36,))).success
    for _ in range(3):  # within its lease
        bend(lower_level, "/walker", stiffness=0.0)
        advance(lower_level, 0.1)
    assert ask(lower_level, "claim", dataclasses.replace(request, positions=(1.5,))).success
    with pytest.raises(CommandRefused, match="2 positions for 1 joints"):
        ask(lower_level, "claim", dataclasses.replace(request, positions=(0.0, 0.0)))


def test_a_stopped_controller_holds_and_refuses(lower_level):
    turn(lower_level, "/driver")
    bend(lower_level, "/arm", position=0.3)
    ask(lower_level, "switch", SwitchRequest(stop=("wheel", "arm")))
    assert lower_level.controllers["wheel"].velocity[0] == 0.0 and lower_level.controllers["arm"].position[0] == 0.3
    ask(lower_level, "switch", SwitchRequest(start=("wheel",)))
    turn(lower_level, "/other")


@pytest.mark.parametrize(
    ("start", "stop", "error", "text"),
    [
        (("weel",), ("arm",), UnknownName, "did you mean: wheel"),
        (("arm",), ("wheel",), CommandRefused, "'arm' runs already"),
        (("arm",), ("arm",), CommandRefused, "to be started and stopped"),
    ],
)
def test_a_switch_is_done_whole_or_not(lower_level, start, stop, error, text):
    with pytest.raises(error) as refusal:
        ask(lower_level, "switch", SwitchRequest(start, stop))
    assert text in str(refusal.value)
    assert set(ask(lower_level, "list_controllers").states) == {"running"}


def test_feed_forward_torque_is_switched_without_a_jump():
    lower_level = make(lease=5.0)
    bend(lower_level, "/arm", effort=10.0, stiffness=0.0, damping=0.0)
    advance(lower_level, 0.25)
    assert torque(lower_level) == pytest.approx(10.0)
    ask_arm(lower_level, "set_ff_torque", Flag(False))
    path = [torque(lower_level) for _ in range(600)]
    assert np.abs(np.diff(path)).max() < 0.03 and path[-1] == 0.0
    ask_arm(lower_level, "set_ff_torque", Flag(True))
    assert torque(lower_level) < 0.03
    advance(lower_level, 0.5)
    assert torque(lower_level) == pytest.approx(10.0)


def allowed(lower_level, folder):
    """Return a gains file that may be read."""
    lower_level.folders.add(folder)
    return folder / "gains.yaml"


def advance_held(lower_level, q):
    """Hold the robot at q until the law has learned what holds it there."""
    for _ in range(10):
        torque(lower_level, q)


def test_gains_of_a_file_ramp_to_the_default(lower_level, tmp_path):
    file = allowed(lower_level, tmp_path)
    file.write_text("gains:\n  shoulder: {stiffness: 100.0, damping: 4.0}\n")
    arm, q = lower_level.controllers["arm"], np.zeros(8)
    q[arm.dofs[0]] = 0.1
    advance_held(lower_level, q)
    before = torque(lower_level, q)
    assert ask_arm(lower_level, "load_gains", FileRequest(str(file))).success
    path = [before, *(torque(lower_level, q) for _ in range(510))]
    assert (arm.stiffness[0], arm.damping[0]) == (pytest.approx(100.0), pytest.approx(4.0))
    assert np.abs(np.diff(path)).max() < 1.1 * (200.0 - 100.0) * 0.1 * DT / 0.5
    arm.start(np.zeros(1))
    assert arm.stiffness[0] == 100.0


def test_a_commanded_gain_does_not_jerk(lower_level):
    arm, q = lower_level.controllers["arm"], np.zeros(8)
    q[arm.dofs[0]] = 0.1
    advance_held(lower_level, q)
    path = [torque(lower_level, q)]
    for _ in range(250):
        bend(lower_level, "/arm", stiffness=400.0)
        path.append(torque(lower_level, q))
    assert arm.stiffness[0] == 400.0
    assert np.abs(np.diff(path)).max() < 1.1 * (400.0 - 200.0) * 0.1 * DT / COMMANDED_DURATION


def test_the_next_owner_finds_the_default_gains(lower_level):
    arm = lower_level.controllers["arm"]
    claim(lower_level, "/soft", ("arm",), ("stiffness",))
    bend(lower_level, "/soft", stiffness=50.0)
    advance(lower_level, 0.25)
    claim(lower_level, "/next", ("arm",), ("position",))
    bend(lower_level, "/next", position=0.0)
    lower_level.release("/soft")
    assert arm.stiffness[0] == 50.0  # a spring whose target another one commands changes slowly
    advance(lower_level, 0.25)
    assert 100.0 < arm.stiffness[0] < 150.0
    advance(lower_level, 0.3)
    assert arm.stiffness[0] == 200.0


def test_gains_are_reported(lower_level):
    reply = ask_arm(lower_level, "get_gains", NoFields())
    assert (reply.names, reply.stiffness, reply.damping) == (("shoulder",), (200.0,), (2.0,))


def test_a_gain_commanded_during_a_ramp_stays():
    lower_level = make(lease=5.0)
    lower_level.controllers["arm"].load_gains([100.0], [4.0])
    advance(lower_level, 0.1)
    bend(lower_level, "/arm", stiffness=77.0)
    advance(lower_level, 0.6)
    assert lower_level.controllers["arm"].stiffness[0] == 77.0
    assert lower_level.controllers["arm"].damping[0] == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("text", "published"),
    [
        ("gains:\n  shoulder: {stiffness: -1.0, damping: 4.0}\n", "gains.yaml:2:25"),
        ("gains:\n  shoulder: {stifness: 1.0, damping: 4.0}\n", "did you mean: stiffness"),
        ("gains:\n  sholder: {stiffness: 1.0, damping: 4.0}\n", "unknown joint 'shoulder'"),
        ("gains: [\n", "gains.yaml:"),
    ],
)
def test_wrong_gains_are_refused_with_their_place(lower_level, tmp_path, text, published):
    file = allowed(lower_level, tmp_path)
    file.write_text(text)
    with pytest.raises(SolferError) as error:
        ask_arm(lower_level, "load_gains", FileRequest(str(file)))
    assert published in str(error.value)
    advance(lower_level, 0.6)
    assert lower_level.controllers["arm"].stiffness[0] == 200.0


def test_gains_come_from_allowed_folders_only(lower_level, tmp_path):
    """Any node may call the service: links, `..` and foreign files get one refusal that reveals nothing."""
    folder = tmp_path / "allowed"
    folder.mkdir()
    lower_level.folders.add(folder)
    secret = tmp_path / "secret.yaml"
    secret.write_text("password: 1234\n")
    (folder / "link.yaml").symlink_to(secret)
    (tmp_path / "other").symlink_to(folder)
    published = set()
    for file in (
        str(secret),
        str(tmp_path / "missing.yaml"),
        "gains.yaml",
        "/etc/passwd",
        f"{folder}/link.yaml",
        f"{folder}/../secret.yaml",
        str(folder),
        f"{folder}/gains.txt",
        "package://solfer/../secret.yaml",
        "package://no_such_package/a/b.yaml",
        f"{folder}/\0.yaml",
        "/" + 5000 * "x" + ".yaml",
    ):
        with pytest.raises(ConfigError) as error:
            ask_arm(lower_level, "load_gains", FileRequest(file))
        published.add(str(error.value).partition("' is not a file")[2])
    assert len(published) == 1 and "folder that is allowed" in published.pop()
    (folder / "gains.yaml").write_text("gains:\n  shoulder: {stiffness: 100.0, damping: 4.0}\n")
    assert ask_arm(lower_level, "load_gains", FileRequest(f"{tmp_path}/other/gains.yaml")).success


def test_gains_of_a_package_of_this_workspace(lower_level):
    with pytest.raises(SolferError, match="there is no 'gains' here|unknown"):  # it was read, and is another robot's
        ask_arm(lower_level, "load_gains", FileRequest("package://solfer/config/robots/centauro/gains.yaml"))
    for file in ("package://std_srvs/cmake/a.yaml", "package://solfer/config/../../../../etc/passwd.yaml"):
        with pytest.raises(ConfigError, match="is not a file that may be read"):
            ask_arm(lower_level, "load_gains", FileRequest(file))


@pytest.mark.slow
def test_an_emergency_stop_fades_springs_and_refuses_commands(lower_level):
    """Torques fade out while damping stays, so that the robot sinks instead of falling; time does not end it."""
    bend(lower_level, "/arm", position=1.0, effort=3.0)
    turn(lower_level, "/driver", 2.0)
    ask(lower_level, "emergency_stop")
    for name, command in (("wheel", turn), ("arm", lambda level, sender: bend(level, sender, position=0.0))):
        with pytest.raises(CommandRefused, match="emergency stop"):
            command(lower_level, f"/other_{name}")
    with pytest.raises(CommandRefused, match="emergency stop: asked for"):
        claim(lower_level, "/other", ("arm",))
    arm = lower_level.controllers["arm"].dofs[0]
    assert lower_level.update(np.zeros(8), np.zeros(8), DT)[1][0] == 0.0
    path = [torque(lower_level) for _ in range(600)]
    assert abs(path[-1]) < 1e-9 and path[100] > 1.0
    v = np.zeros(8)
    v[arm] = 1.0
    for _ in range(10):
        braked = lower_level.update(np.zeros(8), v, DT)[0][arm]
    assert braked == pytest.approx(-2.0, rel=0.02)
    advance(lower_level, 5.0)
    assert lower_level.emergency


def test_a_reset_holds_and_needs_a_new_claim(lower_level):
    """The springs take the posture of that moment, and a sender that never stopped must claim before it commands."""
    bend(lower_level, "/arm", position=1.0)
    ask(lower_level, "emergency_stop")
    q = np.zeros(8)
    q[lower_level.controllers["arm"].dofs[0]] = 0.4
    for _ in range(1000):
        torque(lower_level, q)
        with pytest.raises(CommandRefused):
            bend(lower_level, "/arm", position=1.0)
    ask(lower_level, "reset_emergency_stop")
    assert torque(lower_level, q) == pytest.approx(0.0, abs=1e-6)
    for _ in range(400):  # a sender that goes on is refused; one that claims anew is not
        torque(lower_level, q)
        with pytest.raises(CommandRefused, match="'/arm' are not accepted: emergency stop"):
            bend(lower_level, "/arm", position=1.0)
    claim(lower_level, "/arm", ("arm",))
    bend(lower_level, "/arm", position=0.4)
    assert ask(lower_level, "reset_emergency_stop").success
    assert lower_level.controllers["arm"].position[0] == 0.4


@pytest.mark.parametrize("measured", [-0.4, 0.0, 0.7])
@pytest.mark.parametrize("stiffness", [0.0, 30.0, 900.0])
def test_a_released_joint_is_held_without_a_bump(measured, stiffness):
    """Whatever its gains were, spring and torque pull as before, and a spring with the default gains is at work."""
    lower_level = make(lease=10.0)
    q = np.zeros(8)
    arm = lower_level.controllers["arm"]
    bend(lower_level, "/arm", position=0.2, effort=6.0, stiffness=stiffness, damping=0.5)
    advance(lower_level, 1.5)
    q[arm.dofs[0]] = measured
    before = torque(lower_level, q)
    lower_level.release("/arm")
    assert torque(lower_level, q) == pytest.approx(before, abs=0.2 + 0.01 * abs(before))
    assert (arm.stiffness[0], arm.damping[0], arm.effort[0]) == (200.0, 2.0, 6.0)
    claim(lower_level, "/next", ("arm",), ("position",))
    advance(lower_level, 0.51)
    assert arm.effort[0] == 0.0  # it has no owner


def test_a_commanded_torque_is_not_what_an_earlier_owner_left():
    lower_level = make(lease=10.0)
    bend(lower_level, "/arm", effort=6.0)
    lower_level.release("/arm")
    claim(lower_level, "/next", ("arm",), ("position",))
    advance(lower_level, 0.1)
    bend(lower_level, "/third", effort=5.0)
    advance(lower_level, 1.0)
    assert lower_level.controllers["arm"].effort[0] == 5.0
