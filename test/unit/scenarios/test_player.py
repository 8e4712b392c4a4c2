"""The player of scenarios, against closed formulas, a second implementation and what the original's script sent."""

import gzip
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.allocations import check_that_it_keeps_no_memory
from support.unit.scenarios import made

from solfer.errors import SolferError
from solfer_tools.scenarios import Player, read_scenario

PERIOD = 0.01  # [s]
STAY = {"x_cp": 0, "y_cp": 0, "z_cp": 0}


def run(player):
    """Play to the end; vertex velocities (T, n, 3) and base velocities (T, 4)."""
    rows = []
    while player.step():
        rows.append((player.vertex_velocity.copy(), player.base_velocity.copy()))
    vertices, base = [row[0] for row in rows], [row[1] for row in rows]
    return np.reshape(vertices, (len(rows), *player.vertices.shape)), np.reshape(base, (len(rows), 4))


def test_the_original_sent_the_same(repository):
    """Rows that the original's script sent for `shape_side`; behind them it rested."""
    with gzip.open(repository / "test/data/scenarios/shape_side.txt.gz", "rt") as file:
        rows = np.loadtxt(file)
    player = Player(read_scenario(repository / "config/scenarios/shape_side.yaml"))
    vertices, base = run(player)
    assert len(base) == np.count_nonzero(rows.any(axis=1)) == 390
    assert_allclose(vertices.reshape(-1, 12), rows[:390, :12], atol=1e-12)
    assert_allclose(base, rows[:390, 12:16], atol=1e-12)
    assert_array_equal(player.camber, rows[0, 16:])
    assert not rows[390:].any() and not player.base_velocity.any() and not player.vertex_velocity.any()


@pytest.mark.parametrize("seed", range(4))
def test_vertices_approach_exponentially(tmp_path, seed):
    """The closed form of the geometric approach is the oracle, step by step, and it ends not a step too late."""
    random = np.random.default_rng(seed)
    legs, share = int(random.integers(1, 7)), float(random.uniform(0.005, 0.3))
    start, goals = random.uniform(-1.0, 1.0, (2, 3, legs))
    keys = {f"{axis}_cp": start[row].tolist() for row, axis in enumerate("xyz")}
    keys |= {f"{axis}_cp_ref": [goals[row].tolist()] for row, axis in enumerate("xyz")}
    player = Player(made(tmp_path, [{"type": "move", **STAY, "base": 0}], legs, vel=share, **keys))
    count, way = 0, (goals - start).T
    while player.step():
        left = way * (1.0 - share) ** count
        slow = np.abs(left) * share / PERIOD < 1e-3
        assert_allclose(player.vertex_velocity[~slow], (left * share / PERIOD)[~slow], rtol=1e-9)
        assert_allclose(player.vertices[slow], goals.T[slow], atol=1e-12)
        count += 1
    near = np.maximum(5e-3, 5e-3 * np.abs(goals.T))
    assert np.all(np.abs(player.vertices - goals.T) <= near)
    still = np.abs(way) * (1.0 - share) ** (count - 1)
    assert np.any((still > near) & (still * share / PERIOD >= 1e-3))  # and not a step too late


@pytest.mark.slow
@pytest.mark.parametrize(("goal", "count"), [(0.2, 390), (-0.2, 390), (4.0, 7960), (0.004, 0), (0.3, 590)])
def test_the_base_goes_at_constant_speed(tmp_path, goal, count):
    """5 mm, or 5 parts of 1000 of the goal, are left at the end."""
    tables = {"vel": 0.05, "base_ref": [[0.0, 0.0, goal, 0.0]]}
    _, base = run(Player(made(tmp_path, [{"type": "move", **STAY, "base": 0}], **tables)))
    assert len(base) == pytest.approx(count, abs=1)
    assert_array_equal(base, np.tile([0.0, 0.0, math.copysign(0.05, goal), 0.0], (len(base), 1)))


def test_the_last_millimetre_of_the_base_takes_one_period(tmp_path):
    pattern = [{"type": "move", **STAY, "base": 0}]
    scenario = made(tmp_path, pattern, vel=0.1, base_ref=[[0.1005, 0.0, 0.5, 0.0]])
    player = Player(scenario)
    _, base = run(player)
    assert_allclose(base[:100, 0], 0.1, rtol=1e-12)
    assert_allclose(base[100, 0], 0.0005 / PERIOD, rtol=1e-6)
    assert_allclose(base[101:, 0], 0.0, atol=1e-10)
    assert_allclose(player.base[0], 0.1005, atol=1e-12)


def sums(count, step, start=0.0):
    """Return the sums of the cosines and sines of `count` angles, `step` apart, in closed form."""
    ratio, middle = math.sin(count * step / 2.0) / math.sin(step / 2.0), start + (count - 1) * step / 2.0
    return np.array((ratio * math.cos(middle), ratio * math.sin(middle)))


@pytest.mark.parametrize(("heading", "rate", "speed"), [(1.2, 0.03, 0.015), (-2.0, 0.2, 0.3), (7.0, 0.5, -0.1)])
def test_a_turn_is_a_unicycle(tmp_path, heading, rate, speed):
    pattern = [
        {"type": "speed", "motions": [[3, 3, rate]]},
        {"type": "turn", **STAY, "radius": heading, "angle": speed},
    ]
    player = Player(made(tmp_path, pattern))
    _, base = run(player)
    step = math.copysign(rate * PERIOD, heading)
    assert_allclose(base[:, 3], math.copysign(rate, heading), rtol=1e-12)
    assert_allclose(player.base[:2], speed * PERIOD * sums(len(base), step), rtol=1e-9)
    assert_allclose(np.hypot(base[:, 0], base[:, 1]), abs(speed), rtol=1e-12)
    radius = speed / math.copysign(rate, heading)  # on the circle, but for the length of a step
    assert np.hypot(player.base[0], player.base[1] - radius) == pytest.approx(abs(radius), abs=abs(speed) * PERIOD)
    assert abs(player.base[3] - heading) <= 0.01 < abs(player.base[3] - step - heading) + 1e-12


@pytest.mark.parametrize(
    ("angle", "radius", "x_sign", "y_sign"), [(-4.71, 2.0, -1, -1), (1.5, 4.0, 1, 1), (3.0, 0.5, 1, -1)]
)
def test_a_circle_has_its_radius(tmp_path, angle, radius, x_sign, y_sign):
    pattern = [
        {"type": "speed", "motions": [[3, 3, 0.25]]},
        {"type": "circle", **STAY, "angle": angle, "radius": radius, "x_sign": x_sign, "y_sign": y_sign},
    ]
    player = Player(made(tmp_path, pattern))
    _, base = run(player)
    step = math.copysign(0.25 * PERIOD, angle)
    assert_allclose(player.base[:2], np.array((x_sign, y_sign)) * radius * step * sums(len(base), step), rtol=1e-9)
    center = np.array((0.0, y_sign * radius))
    places = np.cumsum(base[:, :2] * PERIOD, axis=0)
    assert_allclose(np.linalg.norm(places - center, axis=1), radius, atol=radius * abs(step))


def test_the_constant_velocity_goes_on_until_the_end(tmp_path):
    pattern = [{"type": "wait", "steps": 3}]
    player = Player(made(tmp_path, pattern, base_const_vel=[0.1, 0.0, 0.0, -0.2]))
    _, base = run(player)
    assert_array_equal(base, np.tile([0.1, 0.0, 0.0, -0.2], (3, 1)))
    assert not player.base_velocity.any() and not player.step()
    assert_array_equal(player.base, 0.0)  # the script's own numbers go without it


def test_legs_lose_and_get_their_contact(tmp_path):
    pattern = [
        {"type": "wait", "steps": 1},
        {"type": "claim", "leg": 3},
        {"type": "wait", "steps": 1},
        {"type": "claim", "leg": 0},
        {"type": "release", "leg": 3},
        {"type": "wait", "steps": 1},
    ]
    player, seen = Player(made(tmp_path, pattern)), []
    while player.step():
        seen.append(player.grounded.tolist())
    assert seen == [[True] * 4, [True, True, True, False], [False, True, True, True]]


def test_camber_is_that_of_the_newest_move(tmp_path):
    tables = {"cs_ref": [[0.1, -0.1, 0.2, -0.2], [0.0] * 4], "base_ref": [[0.0] * 4, [1.0, 0.0, 0.0, 0.0]]}
    pattern = [
        {"type": "wait", "steps": 1},
        {"type": "move", **STAY, "base": 1, "cs": 0},
        {"type": "move", **STAY, "base": 0},
        {"type": "move", **STAY, "base": 1, "cs": 1},
    ]
    player, seen = Player(made(tmp_path, pattern, **tables)), {}
    while player.step():
        seen.setdefault(player.number, set()).add(tuple(player.camber))
    turned = {(0.1, -0.1, 0.2, -0.2)}
    assert seen == {1: {(0.0,) * 4}, 2: turned, 3: turned, 4: {(0.0,) * 4}}


def test_speeds_are_of_single_numbers(tmp_path):
    pattern = [
        {"type": "speed", "motions": [[0, 2, 0.5], [2, 1, 0.25], [3, 1, 0.7]]},
        {"type": "move", **STAY, "base": 0},
    ]
    tables = {f"{axis}_cp_ref": [[1.0] * 4] for axis in "xyz"} | {"base_ref": [[1.0] * 4]}
    player = Player(made(tmp_path, pattern, **tables))
    player.step()
    expected = np.full((4, 3), 0.1)
    expected[2, 0], expected[1, 2] = 0.5, 0.25
    assert_allclose(player.vertex_velocity * PERIOD, expected)
    assert_allclose(player.base_velocity, [0.1, 0.7, 0.1, 0.1])


def second(scenario):
    """Play in plain numbers, after what is known of the original's script; vertices and base after each step."""
    record, legs, dt = scenario.record, scenario.legs, scenario.period
    now = [list(record.x_cp), list(record.y_cp), list(record.z_cp), list(record.base_now)]
    speed, rows = [[record.vel] * legs for _ in range(3)] + [[record.vel] * 4], []

    def approach(step):
        tables = record.x_cp_ref[step.x_cp], record.y_cp_ref[step.y_cp], record.z_cp_ref[step.z_cp]
        for row, goals in enumerate(tables):
            for leg, goal in enumerate(goals):
                velocity = speed[row][leg] / dt * (goal - now[row][leg])
                now[row][leg] += velocity * dt if abs(velocity) >= 1e-3 else goal - now[row][leg]

    def go(index, goal):
        left = goal - now[3][index]
        velocity = math.copysign(speed[3][index], left) if left else 0.0
        change = velocity * dt if abs(left) >= 1e-3 else left
        now[3][index] += change
        return change

    for step in scenario.pattern:
        if step.type == "speed":
            for row, column, value in step.motions:
                speed[row][column] = value
        elif step.type == "wait":
            rows += [[list(each) for each in now]] * step.steps
        elif step.type == "move":
            tables = record.x_cp_ref[step.x_cp], record.y_cp_ref[step.y_cp], record.z_cp_ref[step.z_cp]
            goals = [*tables, record.base_ref[step.base]]
            flat = [number for each in goals for number in each]
            while any(abs(a - b) > max(5e-3, 5e-3 * abs(b)) for a, b in zip(sum(now, []), flat, strict=True)):
                approach(step)
                for index, goal in enumerate(goals[3]):
                    go(index, goal)
                rows.append([list(each) for each in now])
        elif step.type in ("turn", "circle"):
            goal = step.radius if step.type == "turn" else step.angle
            while abs(goal - now[3][3]) > 1e-2:
                approach(step)
                cos, sin = math.cos(now[3][3]), math.sin(now[3][3])
                change = go(3, goal)
                if step.type == "turn":
                    along = step.angle * dt, step.angle * dt
                else:
                    along = step.x_sign * change * step.radius, step.y_sign * change * step.radius
                now[3][0] += along[0] * cos
                now[3][1] += along[1] * sin
                rows.append([list(each) for each in now])
    return np.array([np.array(row[:3]).T for row in rows]), np.array([row[3] for row in rows])


def drawn(random):
    """Draw the tables and the pattern of a scenario of some legs."""
    legs = int(random.integers(2, 6))
    rows = {f"{axis}_cp_ref": random.uniform(-0.4, 0.4, (3, legs)).round(3).tolist() for axis in "xyz"}
    rows |= {f"{axis}_cp": random.uniform(-0.4, 0.4, legs).round(3).tolist() for axis in "xyz"}
    rows |= {"base_ref": random.uniform(-1.0, 1.0, (3, 4)).round(3).tolist(), "vel": float(random.uniform(0.01, 0.15))}
    pattern = []
    for verb in random.choice(["move", "turn", "circle", "wait", "speed"], 8):
        goals = {f"{axis}_cp": int(random.integers(3)) for axis in "xyz"}
        heading, sign = float(random.uniform(-2.0, 2.0)), random.choice([-1, 1], 2).tolist()
        pattern.append(
            {
                "move": {**goals, "base": int(random.integers(3))},
                "turn": {**goals, "radius": heading, "angle": float(random.uniform(-0.3, 0.3))},
                "circle": {**goals, "angle": heading, "radius": 0.7, "x_sign": sign[0], "y_sign": sign[1]},
                "wait": {"steps": int(random.integers(20))},
                "speed": {"motions": [[int(random.integers(4)), int(random.integers(legs - 1)), 0.06]]},
            }[str(verb)]
            | {"type": str(verb)}
        )
    return legs, rows, pattern


@pytest.mark.daily(2)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_a_second_implementation_goes_the_same_way(tmp_path, seed):
    legs, tables, pattern = drawn(np.random.default_rng(seed))
    scenario = made(tmp_path, pattern, legs, dt=0.02, **tables)
    vertices, base = second(scenario)
    player, count = Player(scenario), 0
    while player.step():
        assert_allclose(player.vertices, vertices[count], atol=1e-9)
        assert_allclose(player.base, base[count], atol=1e-9)
        count += 1
    assert count == len(base) == sum(scenario.periods)


@pytest.mark.daily(2)
@pytest.mark.slow
@pytest.mark.parametrize("period", [0.004, 0.005, 0.01 / 3.0, 0.025, 0.07])
def test_another_period_goes_the_same_way(tmp_path, period):
    """References that integrate the velocities are the file's own, whenever both have a period's end."""
    legs, tables, pattern = drawn(np.random.default_rng(3))
    scenario = made(tmp_path, pattern, legs, base_const_vel=[0.1, 0.0, 0.0, 0.05], **tables)
    own_vertices, own_base = (np.cumsum(each * scenario.period, axis=0) for each in run(Player(scenario)))
    other = Player(scenario, period)
    vertices, base = run(other)
    assert not other.base_velocity.any() and len(base) == pytest.approx(scenario.duration / period, abs=1.0001)
    ends = np.arange(1, len(base) + 1) * period
    times = np.arange(len(own_base) + 1) * scenario.period
    for mine, own in ((base, own_base), (vertices.reshape(len(vertices), -1), own_vertices.reshape(len(own_base), -1))):
        went, there = np.cumsum(mine * period, axis=0), np.vstack([np.zeros(own.shape[1]), own])
        for column in range(own.shape[1]):
            assert_allclose(went[:, column], np.interp(ends, times, there[:, column]), atol=1e-9)


@pytest.mark.slow
def test_a_slower_pace_goes_the_same_way(tmp_path):
    """A pace that changes in each period, as that of one who pauses: velocities times pace, integrated."""
    random = np.random.default_rng(5)
    legs, tables, pattern = drawn(random)
    scenario = made(tmp_path, pattern, legs, **tables)
    vertices, base = run(Player(scenario))
    player, went, turned = Player(scenario), np.zeros(vertices.shape[1:]), np.zeros(4)
    while True:
        pace = float(random.uniform(0.05, 1.0))
        if not player.step(pace * PERIOD):
            break
        went += player.vertex_velocity * pace * PERIOD
        turned += player.base_velocity * pace * PERIOD
    assert_allclose(went, vertices.sum(axis=0) * PERIOD, atol=1e-9)
    assert_allclose(turned, base.sum(axis=0) * PERIOD, atol=1e-9)
    assert player.elapsed == pytest.approx(scenario.duration, abs=1e-6)


def test_time_is_left_until_the_end(tmp_path):
    first, last = {"type": "wait", "steps": 30}, {"type": "wait", "steps": 20}
    pattern = [first, {"type": "speed", "motions": [[3, 0, 0.2]]}, last]
    player, seen = Player(made(tmp_path, pattern)), []
    assert (player.number, player.verb, player.left) == (0, "", pytest.approx(0.5))
    while player.step():
        seen.append((player.number, player.verb))
        assert player.left == pytest.approx(0.5 - len(seen) * PERIOD)
    assert seen == [(1, "wait")] * 30 + [(3, "wait")] * 20
    assert player.is_over and player.left == 0.0 and player.elapsed == pytest.approx(0.5)


@pytest.mark.parametrize("period", [0.0, -1.0, math.nan, math.inf])
def test_a_period_has_to_be_positive(tmp_path, period):
    with pytest.raises(SolferError, match="positive"):
        Player(made(tmp_path, [{"type": "wait", "steps": 1}]), period)


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["move", "circle", "wait"])
def test_a_step_keeps_no_memory(tmp_path, verb):
    step = {
        "move": {**STAY, "base": 0},
        "circle": {**STAY, "angle": 20.0, "radius": 1.0, "x_sign": 1, "y_sign": 1},
        "wait": {"steps": 100_000},
    }[verb]
    speeds = {"type": "speed", "motions": [[3, 0, 0.001], [3, 3, 0.1]]}
    player = Player(made(tmp_path, [speeds, {"type": verb, **step}], base_ref=[[0.2, 0.0, 0.0, 0.0]]))
    check_that_it_keeps_no_memory(player.step)
    assert not player.is_over
