"""The component `wheeled_motion`, without any transport: the original's motion, its mends, `cmd_vel`, mistakes."""

import math
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.declarations import named
from support.unit.wheeled import LOWER, RATE, cycle, make, move, recorded, robot  # noqa: F401, fixtures

from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.drive import WheelsState
from solfer.components.wheeled_motion.original.resteering import Resteering
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import read
from solfer.errors import ComponentError, ConfigError, NotFinite, SizeMismatch, UnknownName
from solfer.interfaces.geometry import Twist, Vector
from solfer.interfaces.support import LEAD
from solfer.interfaces.task_references import GetReference
from solfer.numerics.solvers.damped_descent import DampedDescent

PERIOD = 1.0 / RATE  # [s]
TRACKING = 1e-6  # [rad]


def begin(component, motion):
    """Write the references of a recorded motion."""
    references = component.references
    robot = component.model
    if motion["centred"]:
        references.position[:2] = robot.state.position[:2]
    references.velocity[:2] = motion["velocity"][:2]
    references.angular[2] = motion["velocity"][2]
    references.vertex_velocity[:] = np.reshape(motion["vertices"], (4, 3))


@pytest.mark.parametrize("name", ["ap_forward", "b_turn", "e_footprint", "0_rest"])
def test_the_originals_motion_joint_by_joint(make, recorded, name):
    component = make(law="original")
    motion = recorded[name]
    begin(component, motion)
    done = 0
    for row, positions in motion["rows"]:
        cycle(component, row + 1 - done)
        done = row + 1
        assert_allclose(component.model.command.position[:LOWER], positions, rtol=0.0, atol=TRACKING)


def test_the_originals_first_cycles_task_by_task(make, recorded):
    component = make(law="original")
    begin(component, recorded["ap_forward"])
    cycle(component, 2)
    stack = component.stack
    for level, (task, velocity) in enumerate(recorded["first"], 1):
        part = DampedDescent(stack.ends[: level + 1], stack.size, np.arange(stack.size))
        rows = stack.ends[level]
        found = part.update(stack.jacobian[:rows], stack.velocity[:rows], stack.numbers[:rows, 3])
        assert_allclose(found[:LOWER], velocity, rtol=0.0, atol=1e-8, err_msg=task)


def test_a_wheel_at_its_end_turns_back():
    joint = Resteering(np.array([-2.0]), np.array([2.0]))
    state = np.array([-1.997])
    desired = np.array([-2.01])
    for _ in range(19):
        joint.update(state, desired)
        assert desired == -2.01
    steps = 0
    while True:
        command = np.array([state[0] - 0.02])
        joint.update(state, command)
        if not joint.sides[0]:
            break
        state = command
        steps = steps + 1
    assert steps == np.ceil(2.8 / np.radians(5.0)) and joint.sides[0] == 0.0
    assert_allclose(state, -1.997 + steps * np.radians(5.0))


@pytest.mark.parametrize("velocity", [(0.0, -0.15, 0.0), (0.15, 0.0, 0.2)])
def test_the_base_goes_where_it_is_desired(make, velocity):
    component = make()
    cycle(component, 400, velocity)
    references = component.references
    robot = component.model
    pose = named(component.stack.tasks, "BASE").point.pose.value
    assert_allclose(pose[:2], references.position[:2], atol=2e-4)
    rows = component.stack.jacobian[:12]
    assert abs(rows @ robot.command.velocity).max() < 1e-5  # no wheel slips


def test_the_originals_base_lags(make):
    component = make(law="original")
    component.references.position[:2] = component.model.state.position[:2]
    cycle(component, 500, (0.1, 0.0, 0.0))
    lag = component.references.position[0] - component.model.command.position[0]
    assert_allclose(lag, 0.1 / 2.0, rtol=0.03)  # v / K


def test_it_starts_where_it_stands(make):
    component = make()
    before = component.model.state.position.copy()
    cycle(component, 100)
    assert_allclose(component.model.command.position[:LOWER], before[:LOWER], atol=1e-6)


def test_the_original_starts_with_a_jump(make):
    component = make(law="original")
    assert_allclose(component.references.position[0], component.model.center_of_mass.value[0])
    cycle(component, 2)
    assert component.model.command.velocity[0] > 0.2


def test_wheels_rest_near_their_references(make):
    found = {}
    for rest in (True, False):
        component = make(rest=rest, across=0.0)
        component.references.vertices[:, 1] += 1e-3
        cycle(component, 100)
        found[rest] = abs(component._steering.measured).max()
    assert found[True] < 1e-10 < 1e-6 < found[False]


@pytest.mark.parametrize(("pace", "largest"), [(True, 5e-3), (False, 1.0)])
def test_the_base_waits_for_its_wheels(make, pace, largest):
    component = make(pace=pace)
    errors = []
    paces = []
    for _ in range(100):
        cycle(component, 5, (0.0, 0.1, 0.0))  # all wheels have to turn by a quarter
        errors.append(abs(component.wheels.offsets.errors[:, :2]).max())
        paces.append(component.references.pace)
    assert max(errors) < largest
    if pace:
        assert min(paces) < 0.2 and paces[-1] > 0.99 and component.references.position[1] > 0.1
    else:
        assert max(errors) > 0.02 and min(paces) == 1.0


@pytest.mark.parametrize("across", [0.0, 2.0])
def test_errors_across_the_wheels_steer_them(make, across):
    component = make(across=across)
    component.references.vertices[:, 1] += 0.02
    cycle(component, 600, (0.1, 0.0, 0.0))
    left = abs(component.wheels.offsets.errors[:, 1]).max()
    assert left < 3e-3 if across else left > 6e-3, left


@pytest.mark.parametrize(
    ("axis", "limit", "growth"),
    [(0, 0.04, "acceleration"), (1, 0.04, "acceleration"), (2, 0.015, "turn_acceleration")],
)
def test_errors_of_the_base_are_corrected_slowly(make, axis, limit, growth):
    """However far the base seems to be from its reference, as with a sensor that is wrong."""
    component = make()
    assert (component.tags.correction, component.tags.turn_correction) == (0.04, 0.1)
    component.references.position[:2] += 0.2 * (axis == 0), 0.2 * (axis == 1)
    component.references.heading += 0.2 * (axis == 2)
    rates = []
    for _ in range(200):
        cycle(component)
        base = component.stack.jacobian[component.tasks.rows["BASE"]] @ component.joints.velocity
        rates.append(np.abs(base).max())
    assert max(rates) < 1.01 * limit and rates[-1] > 0.5 * limit
    assert np.diff(rates, prepend=0.0).max() < 1.01 * getattr(component.tags, growth) * component.period


@pytest.mark.parametrize(
    ("speed", "turn", "rise", "followed"),
    [(0.2, 0.0, 0.03, 0.02), (0.0, 0.4, 0.015, 0.005), (0.2, 0.0, 0.005, 0.0), (0.0, 0.0, 0.03, 0.0)],
)
def test_the_height_of_the_base_counts_from_the_ground(make, speed, turn, rise, followed):
    """It goes up with wheels that drive onto something; what a floor's unevenness explains, or lifts them, does not."""
    component = make()
    state = component.model.state
    height = state.position[2]
    cycle(component, 200, (speed, 0.0, turn))
    for _ in range(50):
        state.position[2] = height + rise
        cycle(component)
    assert component.references.rise == pytest.approx(followed, abs=6e-3 if speed else 1e-3)
    assert component.tasks.rates.error[component.tasks.rows["BASE"]][5] == pytest.approx(followed - rise, abs=6e-3)


@pytest.mark.parametrize(("turn", "most"), [(0.0, 0.015), (0.3, 0.096)])
def test_a_pelvis_stays_level_where_it_turns_on_a_slope(make, turn, most):
    """A slope of 15 degrees tilts it by 0.08 rad/s; at rest an IMU with a wrong tilt must not."""
    component = make(tunning="level")
    cycle(component, 200, (0.0, 0.0, turn))
    component.references.tilt[:] = (math.sin(0.1), 0.0, 0.0, math.cos(0.1))
    rates = []
    for _ in range(100):
        cycle(component, 1, (0.0, 0.0, turn))
        base = component.stack.jacobian[component.tasks.rows["BASE"]] @ component.joints.velocity
        rates.append(abs(base[:2]).max())
    assert 0.9 * most < max(rates) < 1.05 * most


@pytest.mark.parametrize(("turn", "correction"), [(0.1, 0.025), (-0.3, 0.045), (0.3, 0.045)])
def test_a_base_that_turns_is_corrected_faster(make, turn, correction):
    component = make()
    cycle(component, 300, (0.0, 0.0, turn))
    component.references.heading += math.copysign(0.14, turn)
    rates = []
    for _ in range(200):
        cycle(component, 1, (0.0, 0.0, turn))
        rates.append(abs((component.stack.jacobian[component.tasks.rows["BASE"]] @ component.joints.velocity)[2]))
    assert abs(turn) + 0.9 * correction < max(rates) < abs(turn) + 1.05 * correction


def test_corrections_count_within_the_speed_of_the_base(make):
    component = make(base_speed=0.1)
    component.references.position[0] += 0.2
    rates = []
    for _ in range(600):
        cycle(component, 1, (0.1, 0.0, 0.0))
        rates.append((component.stack.jacobian[component.tasks.rows["BASE"]] @ component.joints.velocity)[3])
    assert 0.09 < max(rates) < 0.101


def test_what_is_too_far_is_named(make):
    component = make()
    component.references.position[0] += 0.31
    with pytest.raises(ComponentError, match=r"the base is 0\.31 m from its reference") as error:
        cycle(component)
    assert error.value.expected == "0.3 m at most, the tag `furthest`"
    component = make()
    component.references.vertices[2, :2] += 0.5 * component.wheels.offsets.directions[2]
    with pytest.raises(ComponentError, match=r"the vertex of '.*' is 0\.\d+ m from its reference"):
        cycle(component)


def test_it_turns_about_what_is_tracked(make):
    component = make(base="center_of_mass")
    robot = component.model
    before = robot.center_of_mass.value[:2].copy()
    cycle(component, 600, (0.0, 0.0, 0.3))
    robot.update()
    assert_allclose(robot.center_of_mass.value[:2], before, atol=2e-3)
    assert abs(component.wheels.offsets.errors[:, :2]).max() < 3e-3 and component.references.heading > 0.5


def test_joints_at_their_limits_slow_the_motion_down(make):
    component = make()
    robot = component.model
    component.tasks.bounds.speed[11:30:6] = 1.0  # wheels: 0.078 m/s
    cycle(component, 600, (0.2, 0.0, 0.0))
    references = component.references
    assert 0.2 < references.pace < 0.6
    assert_allclose(component.wheels.points["base"].value[3:5], references.position[:2], atol=5e-3)
    assert np.nanmax(abs(robot.command.velocity[11:30:6])) <= 1.0 + 1e-6


def test_joints_stay_within_their_limits(make):
    component = make()
    robot = component.model
    highest = 0.0
    limit = component.tasks.bounds.speed[:LOWER]
    component.references.vertex_velocity[:, 1] = (0.05, -0.05, 0.05, -0.05)
    limit[10:30:6] = 0.4  # slower ankles
    for _ in range(200):
        cycle(component)
        velocity = robot.command.velocity
        highest = max(highest, np.max(abs(velocity[6:LOWER]) / limit[6:]))
        assert abs(velocity[:6]).max() < 0.1 and abs(component.stack.jacobian[:12] @ velocity).max() < 1e-5  # no slip
    assert 0.999 < highest <= 1.0 + 1e-6


@pytest.mark.parametrize(("left_out", "silent", "braking"), [(0, 98, 140), (1, 44, 70)])
def test_the_base_stops_without_messages(make, left_out, silent, braking):
    """Silence and braking, 0.2 m/s at 0.3 m/s2, count by the clock, also where cycles are left out."""
    component = make()
    component.let_pass((1 + left_out) * PERIOD)
    cycle(component, 200, (0.2, 0.0, 0.0))
    cycle(component, silent)
    assert_allclose(component.references.velocity[0], 0.2)
    cycle(component, braking)
    assert not component.references.velocity.any()


def test_wheels_stay_where_silence_leaves_them(make):
    components = {}
    for silent in (True, False):
        component = components[silent] = make()
        cycle(component, 200, (0.2, 0.0, 0.0))
        component.references.vertices[:, 1] += 8e-3  # behind which the wheels are
        cycle(component, 300, None if silent else (0.0, 0.0, 0.0))
    turned = {silent: abs(each._steering.measured).max() for silent, each in components.items()}
    assert turned[True] < 0.2 < 0.5 < turned[False], turned
    assert not components[True].references.velocity.any()


def speeds_and_changes(component, count, of):
    """Run cycles; return the largest velocity of a reference, and its largest change in a second."""
    before = of(component.references).copy()
    speed = 0.0
    change = 0.0
    for _ in range(count):
        cycle(component)
        now = of(component.references).copy()
        speed, change = max(speed, np.linalg.norm(now)), max(change, np.linalg.norm(now - before) / PERIOD)
        before = now
    return speed, change


def test_vertices_go_to_places_by_a_pipe(make):
    component = make()
    desired = component.references.vertices.copy()
    port = component.inputs["vertices"]
    desired[:, 1] *= 0.85
    port.value[:] = desired
    port.fresh = True
    cycle(component)
    port.fresh = False
    speed, change = speeds_and_changes(component, 800, lambda references: references.vertex_velocity[0])
    assert_allclose(component.references.vertices[:, :2], desired[:, :2], atol=1e-9)
    assert abs(component.wheels.offsets.errors[:, :2]).max() < 3e-3
    assert 0.02 < speed <= 0.1 + 1e-9 and change <= 0.2 + 1e-6


def test_the_base_goes_to_a_pose_by_a_pipe(make):
    component = make()
    references = component.references
    port = component.inputs["base"]
    desired = references.position + (0.2, 0.1, -0.02)
    turn = 0.4
    port.value[:] = (*desired, 0.0, 0.0, np.sin(turn / 2.0), np.cos(turn / 2.0))
    port.fresh = True
    cycle(component)
    port.fresh = False
    speed, change = speeds_and_changes(component, 900, lambda references: references.velocity)
    assert_allclose((*references.position, references.heading), (*desired, turn), atol=1e-9)
    assert_allclose(component.wheels.points["base"].value[3:], desired, atol=1e-3)
    assert speed <= 0.5 + 1e-9 and change <= 0.3 + 1e-6


def guide(component, place, vertices=None):
    """Let positions be received for one cycle: x, y, heading of the base [m, rad], and vertices."""
    base = component.inputs["base"]
    port = component.inputs["vertices"]
    x, y, heading = place
    base.value[:] = x, y, component.references.position[2], 0.0, 0.0, np.sin(heading / 2.0), np.cos(heading / 2.0)
    base.fresh = True
    if vertices is not None:
        port.value[:] = vertices
        port.fresh = True
    cycle(component)
    base.fresh = port.fresh = False


def test_positions_ahead_of_a_motion_are_followed_without_a_lag(make):
    """A circle at 0.15 m/s and 0.3 rad/s, while the vertices go inwards: a closed expression of the time."""
    component = make()
    references = component.references
    rate = 0.3
    radius = 0.5
    begin = references.position.copy()
    vertices = references.vertices.copy()
    time = 0.0
    rows = []
    for index in range(1600):
        time += PERIOD * references.pace * component.targets.ratio  # of the course, which waits for the wheels
        speed = rate * min(1.0, time / 1.5)
        angle = rate * (0.5 * time**2 / 1.5 if time < 1.5 else time - 0.75)
        x, y = radius * np.sin(angle), radius * (1.0 - np.cos(angle))
        inward = vertices * (1.0, 1.0 - 0.02 * angle, 1.0)
        rows.append((*references.position[:2] - begin[:2] - (x, y), references.heading - angle))
        if index % 4 == 0:
            ahead = x + LEAD * radius * speed * np.cos(angle), y + LEAD * radius * speed * np.sin(angle)
            moving = inward - vertices * (0.0, 0.02 * LEAD * speed, 0.0)
            guide(component, (*(begin[:2] + ahead), angle + LEAD * speed), moving)
        else:
            cycle(component)
    away = np.abs(rows)
    assert angle > 1.5 and away[:, :2].max() < 6e-3 and away[:, 2].max() < 0.02
    assert np.abs(references.vertices - inward)[:, 1].max() < 1e-3


def test_positions_that_cease_are_named_and_it_comes_to_rest(make, caplog):
    component = make()
    begin = component.references.position.copy()
    for index in range(100):
        guide(component, (begin[0] + 0.2 * index * PERIOD, begin[1], 0.0))
    assert component.references.velocity[0] > 0.02
    last = begin[0] + 0.2 * 99 * PERIOD
    cycle(component, 250)
    assert not component.references.velocity.any() and not component.targets.has_base
    assert component.references.position[0] < last - 5e-3  # it does not go there by itself
    assert "no position for 0.55 s" in caplog.text


def test_positions_that_repeat_before_they_are_reached_are_a_stream(make, caplog):
    """A sender that waits for the pace repeats its last position; without more of them the base rests where it is."""
    component = make()
    references = component.references
    x, y = references.position[:2].tolist()
    for index in range(200):
        guide(component, (x + 0.2 * PERIOD * min(index, 100), y, 0.0))
        component.pace = 1.0 if index < 100 else 0.0
    left = x + 0.2 * PERIOD * 100 - references.position[0]
    component.pace = 1.0
    cycle(component, 400)
    assert "no position for 0.55 s, it comes to rest" in caplog.text and not references.velocity.any()
    assert x + 0.2 * PERIOD * 100 - references.position[0] > 0.3 * left > 0.01


def test_vertices_end_with_the_base_whose_stream_has_ended(make):
    """Those that were sent again and again at one place stay where they are then, and wheels rest."""
    component = make()
    references = component.references
    x, y = references.position[:2].tolist()
    vertices = references.vertices * (1.0, 0.9, 1.0)
    for index in range(100):
        guide(component, (x + 0.2 * PERIOD * index, y, 0.0), vertices)
    cycle(component, 300)
    left = np.abs(vertices - references.vertices).max()
    cycle(component, 100)
    assert left == np.abs(vertices - references.vertices).max() > 3e-3
    assert not references.velocity.any() and not references.vertex_velocity.any()


def test_a_position_that_jumps_is_named_and_ignored(make, caplog):
    component = make()
    begin = component.references.position.copy()
    for index in range(40):
        guide(component, (begin[0] + 0.1 * index * PERIOD, begin[1], 0.0))
    velocity = component.references.velocity.copy()
    guide(component, (begin[0] - 2.0, begin[1], 0.0))
    assert "'base' jumps by 2." in caplog.text
    assert_allclose(component.references.velocity, velocity, atol=0.3 * PERIOD)
    for _ in range(150):  # who insists has another goal
        guide(component, (begin[0] - 2.0, begin[1], 0.0))
    assert component.references.velocity[0] < -0.01


def test_it_says_where_its_references_are(make):
    component = make()
    get = named(component.services(), "get_reference")
    references = component.references
    base = get.handler(GetReference("base")).values
    assert_allclose(base[:3], references.position)
    assert_allclose(2.0 * np.arctan2(base[5], base[6]), references.heading)
    assert_allclose(np.reshape(get.handler(GetReference("vertices")).values, (4, 3)), references.vertices)
    with pytest.raises(UnknownName, match="vertexes"):
        get.handler(GetReference("vertexes"))


def test_vertices_by_the_originals_topic(make, caplog):
    component = make()
    support = named(component.topics(), "wheels_support")
    references = component.references
    start = references.vertices.copy()
    for _ in range(10):
        support.handler(WheelsSupport(velocity=(0.0, -0.02, 0.0, 0.0, 0.02, 0.0) * 2))
        cycle(component, 20)
    assert_allclose(references.vertex_velocity[:, 1], (-0.02, 0.02, -0.02, 0.02))
    cycle(component, 150)  # without messages
    assert not references.vertex_velocity.any() and "no velocity for 0.55 s" in caplog.text
    support.handler(WheelsSupport(position=tuple(start.ravel())))
    cycle(component, 800)
    assert_allclose(references.vertices[:, :2], start[:, :2], atol=1e-9)


def test_the_base_by_the_originals_topic(make):
    component = make()
    state = named(component.topics(), "wheels_state")
    references = component.references
    references.heading = 0.0
    start = references.position.copy()
    for _ in range(20):
        state.handler(WheelsState(x=0.05, z=-0.01, rz=0.2, cs=(0.02, -0.02, 0.02, -0.02)))
        cycle(component, 20)
    assert_allclose(references.velocity, (0.05, 0.0, -0.01), atol=1e-12)  # in the world, whatever the heading
    assert references.heading > 0.2 and abs(references.position[1] - start[1]) < 1e-9
    assert_allclose(references.camber, (0.02, -0.02, 0.02, -0.02))


def test_velocities_are_bounded(make):
    component = make()
    move(component, 3.0, 4.0, -7.0)
    named(component.topics(), "wheels_support").handler(WheelsSupport(velocity=(1.0, 0.0, 0.0) * 4))
    for _ in range(100):
        component._take_over(0.0)
    assert_allclose(component.references.velocity, (0.09, 0.12, 0.0))  # 0.3 m/s2 for 0.5 s
    assert_allclose(component.wheels.offsets.heading, 0.0)
    assert_allclose(component.references.angular[2], -0.25)
    assert_allclose(
        component.references.vertex_velocity[:, 0], 0.5 / 7.0
    )  # one share of all: the path stays what it is


@pytest.mark.parametrize(
    ("topic", "message", "kind"),
    [
        ("wheels_state", WheelsState(x=np.inf), NotFinite),
        ("wheels_state", WheelsState(x=0.1, cs=(0.1, 0.1)), SizeMismatch),
        ("wheels_support", WheelsSupport(position=(0.1,) * 11), SizeMismatch),
        ("wheels_support", WheelsSupport(velocity=(np.nan,) * 12), NotFinite),
        ("wheels_support", WheelsSupport(velocity=(1e20,) * 12), NotFinite),
        ("wheels_support", WheelsSupport(position=(1e308,) * 12), NotFinite),
        ("cmd_vel", Twist(Vector(1.7e308, 1.7e308), Vector()), ComponentError),
        ("cmd_vel", Twist(Vector(np.nan), Vector()), NotFinite),
    ],
)
def test_messages_that_do_not_fit_change_nothing(make, topic, message, kind):
    component = make()
    with pytest.raises(kind):
        named(component.topics(), topic).handler(message)
    cycle(component, 5)
    assert not component.references.velocity.any() and not component.references.vertex_velocity.any()


@pytest.mark.parametrize(
    ("tags", "kind", "words"),
    [
        ({"track": "camber"}, UnknownName, "unknown wheel among the robot's contacts 'ankle2_1'"),
        ({"chain": "nobody"}, UnknownName, "group"),
        ({"steering": "reactiv"}, UnknownName, "steering 'reactiv'"),
        ({"ik": ("CONSTRAINTS", "BODY")}, UnknownName, "task 'BODY'"),
        ({"tunning": "fast"}, UnknownName, "tuning 'fast'"),
    ],
)
def test_mistakes_are_named_with_their_places(make, tags, kind, words):
    with pytest.raises(kind, match=words) as caught:
        make(**tags)
    assert "centauro.yaml" in str(caught.value)


@pytest.mark.parametrize(
    ("line", "law", "warning"),
    [
        ("law: original", "original", ""),
        ("faithful: true", "original", "3:1: faithful: the key 'faithful' is no more: `law: original` takes its place"),
        ("faithful: false", "improved", "`law: improved` takes its place"),
    ],
)
def test_the_law_of_files_of_earlier_versions(tmp_path, caplog, line, law, warning):
    (tmp_path / "wheels.yaml").write_text(f"track: wheels\nIK: [BASE]\n{line}\n")
    tags = read(tmp_path / "wheels.yaml", WheeledMotion.Tags)
    assert tags.law == law and warning in caplog.text and bool(warning) == bool(caplog.text)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        *(
            (f"{tag}: true", f"3:1: {tag}: the key '{tag}' is no more: `law: improved` has it, `law: original` does")
            for tag in ("feed_forward", "start_in_place", "prompt", "limits")
        ),
        ("faithful: 3", "'faithful' is no more: `law: original` or `law: improved` takes its place"),
        ("law: originel", "expected 'original' or 'improved', got 'originel'"),
        ("law: original\npace: true\nrest: false", "`law: original` with `rest`, `pace`: it has none of these"),
    ],
)
def test_tags_that_are_no_more_name_their_successors(tmp_path, line, words):
    (tmp_path / "wheels.yaml").write_text(f"track: wheels\nIK: [BASE]\n{line}\n")
    with pytest.raises(ConfigError, match=re.escape(words)):
        read(tmp_path / "wheels.yaml", WheeledMotion.Tags)


def test_kinematics_are_required(make):
    component = make()
    component.kinematics = False
    with pytest.raises(ComponentError, match="without kinematics"):
        component.set_rate(RATE)
