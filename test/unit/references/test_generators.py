"""References that need no program: against finite differences, their ends, their speeds, and mistakes with places."""

import json
import math
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.config import read
from solfer.config.tasks.references import ReferenceRecord
from solfer.errors import ConfigError, SizeMismatch, SolferError, UnknownName
from solfer.numerics.rotations import quaternion_product, rotation_from_quaternion
from solfer.references import build_reference, joints_of

START = {
    "position": np.array((0.3, -0.2, 0.8)),
    "orientation": np.array((0.1, -0.2, 0.3, 0.9)) / math.sqrt(0.95),
    "pose": np.append((0.3, -0.2, 0.8), np.array((0.1, -0.2, 0.3, 0.9)) / math.sqrt(0.95)),
    "posture": np.array((0.4, -1.0)),
}
HALF = math.sqrt(0.5)
JOINTS = ("elbow", "wrist")
TURNS = [{"time": 1.0, "orientation": [HALF, 0.0, 0.0, HALF]}, {"time": 2.5, "orientation": [0.0, 0.6, 0.0, 0.8]}]
PLACES = [{"time": 0.8, "position": [0.1, 0.0, 0.0]}, {"time": 2.0, "position": [0.1, 0.2, -0.1]}]
CASES = {
    "circle": ("position", {"circle": {"radius": 0.1, "period": 2.0, "plane": "xz", "turns": 1.5}}),
    "circle without end": ("pose", {"circle": {"radius": 0.1, "period": 2.0, "normal": [1.0, 2.0, -2.0]}}),
    "part of a circle": ("position", {"circle": {"radius": 0.1, "period": 2.0, "plane": "yx", "turns": 0.1}}),
    "line": ("position", {"line": {"to": [0.1, -0.2, 0.3], "speed": 0.25}}),
    "line and back": ("pose", {"line": {"to": [0.1, -0.2, 0.3], "duration": 1.5, "back": True}}),
    "line to a place": ("position", {"line": {"to": [0.1, -0.2, 0.3], "speed": 0.25}, "absolute": True}),
    "sine": ("position", {"sine": {"amplitude": [0.1, 0.0, -0.05], "period": 1.0, "turns": 2}}),
    "sine of joints": ("posture", {"sine": {"amplitude": {"wrist": 0.5}, "period": 3.0}}),
    "places": ("position", {"waypoints": PLACES}),
    "turns": ("orientation", {"waypoints": TURNS}),
    "turns of the frame": ("orientation", {"waypoints": TURNS, "absolute": True}),
    "poses": ("pose", {"waypoints": [PLACES[0], TURNS[1] | {"time": 2.0}], "absolute": True}),
    "joints": ("posture", {"waypoints": [{"time": 1.0, "joints": {"elbow": 0.5}}, {"time": 2.0, "joints": {}}]}),
}


@pytest.fixture
def made(tmp_path):
    """Make the reference of a map of keys."""

    def made(quantity, content):
        file = tmp_path / "reference.yaml"
        file.write_text(json.dumps(content))
        return build_reference(read(file, ReferenceRecord), quantity, JOINTS if quantity == "posture" else ())

    return made


@pytest.fixture
def table(tmp_path, made):
    """Make the reference of a CSV file."""

    def table(text, quantity="position", **keys):
        (tmp_path / "way.csv").write_text(text)
        return made(quantity, {"file": "way.csv", **keys})

    return table


def sampled(reference, start, times):
    """Return values and velocities at times."""
    reference.start(start)
    rows = [(np.zeros(reference.size), np.zeros(reference.rates)) for _ in times]
    for time, (position, velocity) in zip(times, rows, strict=True):
        reference.at(time, position, velocity)
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


def turn_rate(before, after, time):
    """Return the angular velocity between two quaternions in the axes of the reference, by their rotation matrices."""
    turn = rotation_from_quaternion(after) @ rotation_from_quaternion(before).T
    return np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])) / (2.0 * time)


@pytest.mark.parametrize("name", CASES)
def test_velocities_are_differences_of_positions(made, name):
    """Central differences are the oracle; it begins at its start and ends at rest, without a jump."""
    quantity, content = CASES[name]
    reference, step = made(quantity, content), 1e-5
    reference.start(START[quantity])
    end = reference.duration if math.isfinite(reference.duration) else 4.0
    middles = np.linspace(0.0, end + 0.1, 201)
    times = np.sort(np.concatenate([middles - step, middles, middles + step]))
    positions, velocities = sampled(reference, START[quantity], times)
    before, now, after = positions[::3], velocities[1::3], positions[2::3]
    linear = reference.size - (4 if reference.size != reference.rates else 0)
    assert_allclose(now[:, :linear], (after - before)[:, :linear] / (2.0 * step), atol=2e-4)
    if linear < reference.size:
        rates = [turn_rate(a[linear:], b[linear:], 2.0 * step) for a, b in zip(before, after, strict=True)]
        assert_allclose(now[:, linear:], rates, atol=2e-4)
        assert_allclose(np.linalg.norm(positions[:, linear:], axis=1), 1.0, atol=1e-12)
    assert_allclose(positions[0], START[quantity], atol=1e-12)
    assert not velocities[0].any() and np.abs(now).max() > 0.01
    if math.isfinite(reference.duration):
        assert np.array_equal(positions[-1], positions[-2]) and not velocities[-1].any()
    jumps = np.abs(np.diff(velocities[1::3], axis=0)).max()
    assert jumps < 0.1 * np.abs(velocities).max() + 1e-9


@pytest.mark.parametrize("name", CASES)
def test_evaluation_allocates_nothing(made, name):
    """References are evaluated in the control cycle, which must not allocate."""
    quantity, content = CASES[name]
    reference = made(quantity, content)
    reference.start(START[quantity])
    position, velocity = np.zeros(reference.size), np.zeros(reference.rates)
    for time in (0.1, 0.2):
        reference.at(time, position, velocity)
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for index in range(200):
            reference.at(0.3 + 0.001 * index, position, velocity)
        kept = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert kept < 1000


@pytest.mark.parametrize("name", CASES)
def test_a_look_at_the_speeds_changes_nothing(made, name):
    """What is looked at before the start, or after it, moves as before; speeds are those of differences."""
    quantity, content = CASES[name]
    reference = made(quantity, content)
    times = np.linspace(0.0, 3.0, 31)
    before, velocities = sampled(reference, START[quantity], times)
    looked = reference.velocities()
    rows = [(np.zeros(reference.size), np.zeros(reference.rates)) for _ in times]
    for time, (position, velocity) in zip(times, rows, strict=True):
        reference.at(time, position, velocity)
    assert np.array_equal([row[0] for row in rows], before)
    assert np.abs(looked).max() >= np.abs(velocities).max() * 0.999


def test_a_circle_has_its_radius_and_its_plane(made):
    reference = made(*CASES["circle without end"])
    positions, velocities = sampled(reference, START["pose"], np.linspace(0.0, 5.0, 101))
    away = positions[:, :3] - START["pose"][:3]
    assert np.abs(away @ (1.0, 2.0, -2.0)).max() < 1e-12
    center = 0.5 * (away.min(axis=0) + away.max(axis=0))
    assert_allclose(np.linalg.norm(away - center, axis=1), 0.1, atol=1e-4)
    assert_allclose(np.linalg.norm(velocities[20:, :3], axis=1), 0.1 * math.pi, rtol=1e-12)
    assert_allclose(positions[:, 3:], np.tile(START["pose"][3:], (101, 1)))
    half = made("position", {"circle": {"radius": 0.1, "period": 2.0, "plane": "xz", "turns": 0.5}})
    end, _ = sampled(half, START["position"], [half.duration])
    assert_allclose(end[0] - START["position"], (-0.2, 0.0, 0.0), atol=1e-12)


def test_lines_end_where_they_are_to_end(made):
    way = np.array((0.1, -0.2, 0.3))
    line = made(*CASES["line"])
    assert line.duration == pytest.approx(1.875 * np.linalg.norm(way) / 0.25)
    assert np.linalg.norm(line.velocities(), axis=1).max() == pytest.approx(0.25)
    assert_allclose(sampled(line, START["position"], [9.0])[0][0], START["position"] + way)
    place = made(*CASES["line to a place"])
    assert_allclose(sampled(place, START["position"], [9.0])[0][0], way)
    back = made(*CASES["line and back"])
    positions, _ = sampled(back, START["pose"], [1.5, 3.0])
    assert_allclose(positions[:, :3], START["pose"][:3] + (way, np.zeros(3)), atol=1e-12)


def test_way_points_are_met_and_not_overshot(made):
    reference = made(*CASES["places"])
    positions, _ = sampled(reference, np.zeros(3), [0.8, 2.0])
    assert_allclose(positions, [[0.1, 0.0, 0.0], [0.1, 0.2, -0.1]], atol=1e-12)
    between, _ = sampled(reference, np.zeros(3), np.linspace(0.0, 2.0, 101))
    assert between.max() <= 0.2 + 1e-12 and between.min() >= -0.1 - 1e-12
    turned, _ = sampled(made(*CASES["turns"]), START["orientation"], [1.0, 2.5])
    expected = quaternion_product((HALF, 0.0, 0.0, HALF), START["orientation"].tolist())
    assert abs(turned[0].dot(expected)) == pytest.approx(1.0)
    absolute, _ = sampled(made(*CASES["turns of the frame"]), START["orientation"], [1.0, 2.5])
    assert abs(absolute[1].dot((0.0, 0.6, 0.0, 0.8))) == pytest.approx(1.0)
    pose, _ = sampled(made(*CASES["poses"]), START["pose"], [0.8, 2.0])
    assert abs(pose[0, 3:].dot(START["pose"][3:])) == pytest.approx(1.0)  # it does not say how it is turned there
    joints, _ = sampled(made(*CASES["joints"]), START["posture"], [1.0])
    assert_allclose(joints[0] - START["posture"], (0.5, 0.0), atol=1e-12)


def test_tables_are_followed(table):
    reference = table("t,x,y,z\n# by hand\n0,1,1,1\n\n1.0, 1.1,1,1\n2.0,1.2,0.9,1\n")
    positions, _ = sampled(reference, START["position"], [0.0, 1.0, 5.0])
    assert_allclose(positions - START["position"], [[0, 0, 0], [0.1, 0, 0], [0.2, -0.1, 0]], atol=1e-12)
    places = table("1.0,0.1,0.2,0.3", absolute=True)
    assert_allclose(sampled(places, START["position"], [1.0])[0][0], (0.1, 0.2, 0.3))
    joints = table("time,wrist\n1.0,0.5\n", "posture")
    assert_allclose(sampled(joints, START["posture"], [1.0])[0][0] - START["posture"], (0.0, 0.5), atol=1e-12)


HALF_TURN = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))


@pytest.mark.parametrize(
    ("text", "quantity", "end"),
    [
        ("z,time,y,x\n0.3,1,0.2,0.1\n", "position", (0.1, 0.2, 0.3)),
        ("time [ms],x (mm), y [cm],z[m]\n1000,100,20,0.3\n", "position", (0.1, 0.2, 0.3)),
        ('\ufeff"stamp","position.y","position.x",z\r\n1,0.2,0.1,0.3\r\n', "position", (0.1, 0.2, 0.3)),
        ("# time: by hand\n1,0.1,0.2,0.3\n", "position", (0.1, 0.2, 0.3)),
        ("t,w,x,y,z\n1,0.70710678,0,0,0.70710678\n", "orientation", HALF_TURN),
        ("time,qw,qz,qy,qx\n1,0.70710678,0.70710678,0,0\n", "orientation", HALF_TURN),
        (
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
            "1000000000,0.1,0.2,0.3,0.70710678,0,0,0.70710678\n",
            "pose",
            (0.1, 0.2, 0.3, *HALF_TURN),
        ),
        (
            "# ground truth of a walk\n# timestamp tx ty tz qx qy qz qw\n1.0 0.1 0.2 0.3 0 0 0.70710678 0.70710678\n",
            "pose",
            (0.1, 0.2, 0.3, *HALF_TURN),
        ),
        ("wrist [deg],time\n90,1\n", "posture", (np.nan, np.pi / 2.0)),
    ],
)
def test_names_and_units_of_columns_count(table, text, quantity, end):
    start = START[quantity].copy()
    found = sampled(table(text, quantity, absolute=True), start, [1.0])[0][0]
    assert_allclose(found, np.where(np.isnan(end), start, end), atol=1e-8)


@pytest.mark.parametrize(
    ("text", "quantity", "what"),
    [
        ("time,x,y,q\n1,0,0,0\n", "position", r":1:10: unknown column 'q'.*expected: time, x, y, z"),
        ("time,x,y,zz\n1,0,0,0\n", "position", r":1:10: unknown column 'zz'.*z"),
        ("timme,x,y,z\n1,0,0,0\n", "position", r":1:1: unknown column 'timme'.*time"),
        ("time,x,y,v_z\n1,0,0,0\n", "position", ":1:10: unknown column 'v_z'"),
        ("time,x,z\n1,0,0\n", "position", ":1:1: there is no column 'y'"),
        ("x,y,z\n1,0,0\n", "position", ":1:1: there is no column 'time'"),
        ("time,x,tx,z\n1,0,0,0\n", "position", ":1:8: column 'x' is there twice"),
        ("time,x [ft],y,z\n1,0,0,0\n", "position", ":1:6: 'x' in 'ft'.*expected: one of m, cm, mm"),
        ("time [min],x,y,z\n1,0,0,0\n", "position", ":1:1: 'time' in 'min'"),
        ("time,qx,qy,qz,qw [deg]\n1,0,0,0,1\n", "orientation", ":1:15: 'qw' in 'deg'"),
        ("# time, x, y, hz\n1,0,0,0\n", "position", ":1:15: unknown column 'hz'"),
        ("#timestamp [ns],x,y,z\n1403636580838555648,0,0,0\n", "position", ":2:1: .14036365808"),
    ],
)
def test_columns_that_are_unknown_or_missing_have_their_place(table, text, quantity, what):
    with pytest.raises(SolferError, match=f"(?s)way.csv{what}"):
        table(text, quantity)


@pytest.mark.parametrize(
    ("text", "place", "kind"),
    [
        ("0,0,0,0\n1,0.1,oops,0\n", "way.csv:2:7: 'oops'", ConfigError),
        ("0,0,0,0\n1,0.1,nan,0\n", "way.csv:2:7: 'nan'", ConfigError),
        ("0,0,0,0\n1,0.1, inf,0\n", "way.csv:2:8: 'inf'", ConfigError),
        ("0,0,0,0\n1,0.1,0\n", "way.csv:2:1: 3 numbers", SizeMismatch),
        ("0,0,0,0\n1,0,0,0\n1,0,0,0\n", "way.csv:3:1: a time of 1 s after one of 1 s", ConfigError),
        ("-1,0,0,0\n", "way.csv:1:1: a time of -1 s", ConfigError),
        ("t,x,y,z\n", "way.csv:1:1: .*no motion", ConfigError),
        ("1,1e5,0,0\n", "way.csv:1:3: '1e5'", ConfigError),
    ],
)
def test_mistakes_of_a_table_have_line_and_column(table, text, place, kind):
    with pytest.raises(kind, match=place):
        table(text)


def test_mistakes_of_other_tables(table, made):
    with pytest.raises(UnknownName, match="way.csv:1:6: unknown joint 'elbw'") as error:
        table("time,elbw\n1.0,0.5\n", "posture")
    assert error.value.names == ("elbow",)
    with pytest.raises(ConfigError, match="way.csv:1:12: joint 'elbow' is there twice"):
        table("time,elbow,elbow\n1.0,0.5,0\n", "posture")
    with pytest.raises(ConfigError, match="way.csv:1:3: the quaternion"):
        table("1,0.5,0.5,0.5,0.6\n", "orientation")
    with pytest.raises(ConfigError, match=r"reference.yaml:1:\d+: file: there is no file .*no.csv"):
        made("position", {"file": "no.csv"})
    with pytest.raises(ConfigError, match="would jump"):
        table("0,0,0,0\n1,0.1,0,0\n", absolute=True)


CIRCLE = {"radius": 0.1, "period": 2.0, "plane": "xz"}


@pytest.mark.parametrize(
    ("quantity", "content", "what"),
    [
        ("position", {}, "no kind; expected one of circle, line"),
        ("position", {"circle": CIRCLE, "sine": {"amplitude": [1, 0, 0], "period": 1}}, "'circle' and 'sine'"),
        ("position", {"circle": CIRCLE, "absolute": True}, "a circle begins where the reference is"),
        ("position", {"circle": {"radius": 0.1, "period": 2.0}}, "a 'plane' or a 'normal'"),
        ("position", {"circle": CIRCLE | {"normal": [0, 0, 1]}}, "a 'plane' or a 'normal'"),
        ("position", {"circle": CIRCLE | {"plane": "xw"}}, "circle.plane: expected 'xy'"),
        ("position", {"circle": CIRCLE | {"radios": 1}}, "unknown key 'radios'"),
        ("position", {"line": {"to": [0, 0, 1]}}, "a 'speed' or a 'duration'"),
        ("position", {"sine": {"amplitude": [1], "period": 1}}, "sine.amplitude: 1 amplitudes"),
        ("orientation", {"circle": CIRCLE}, "there is no circle of this"),
        ("posture", {"line": {"to": [0, 0, 1], "speed": 1}}, "there is no line of this"),
        ("posture", {"sine": {"amplitude": {"elbo": 1}, "period": 1}}, "unknown joint 'elbo'"),
        ("position", {"waypoints": [{"time": 1}, {"time": 1}]}, r"waypoints\[1\].time: a time of 1 s after one of 1 s"),
        ("position", {"waypoints": TURNS}, r"waypoints\[0\].orientation: there is no 'orientation' here"),
        ("orientation", {"waypoints": [{"time": 1, "orientation": [0, 0, 0, 0.5]}]}, "the quaternion"),
        ("position", {"waypoints": [{"time": 0}]}, "no motion"),
    ],
)
def test_mistakes_have_their_place(made, quantity, content, what):
    with pytest.raises(SolferError, match=rf"reference.yaml:1:\d+: .*{what}"):
        made(quantity, content)


def test_joints_are_those_that_a_reference_names(tmp_path):
    (tmp_path / "way.csv").write_text("# time of joints\nt, wrist,elbow\n1,0,0\n")
    names = {
        "wrist": {"sine": {"amplitude": {"wrist": 0.1}, "period": 1.0}},
        "wrist elbow": {"file": "way.csv"},
        "elbow": {"waypoints": [{"time": 1.0, "joints": {"elbow": 0.5}}]},
    }
    file = tmp_path / "reference.yaml"
    for joints, content in names.items():
        file.write_text(json.dumps(content))
        assert joints_of(read(file, ReferenceRecord)) == joints.split()
    file.write_text(json.dumps({"sine": {"amplitude": [0.1], "period": 1.0}}))
    with pytest.raises(ConfigError, match="names no joint"):
        joints_of(read(file, ReferenceRecord))
