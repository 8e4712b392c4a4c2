"""`benchmark/transport.py` and `benchmark/estimation.py --transport` on a log of seconds that is computed."""

import logging
import math
import sys

import numpy as np
import pytest
import yaml
from support.estimation import part
from support.robots import centauro

from solfer.middleware.memory import FaultsRecord
from solfer.model.kinematics import Kinematics
from solfer.simulation.bundle import load_bundle

log_module, replay, transport = (
    part(name) for name in ("estimation_cases.log", "estimation_cases.replay", "transport")
)
estimation, play = part("estimation"), part("estimation_cases.play")
ROBOT, RADIUS, BEGIN = log_module.ROBOT, 0.078, play.BEGIN
SPEED, REST, GOES, STOPS = 0.3, 0.3, 0.2, 1.0
"""Speed [m/s], and times at which the robot goes, takes to reach its speed, and stops again [s]."""
CASES = ("nothing", "10 % of joints lost", "both 0-15 ms late", "bad")


@pytest.fixture(scope="module")
def kinematics() -> Kinematics:
    """Return the kinematics of CENTAURO."""
    return load_bundle(ROBOT / "robot.yaml").kinematics


def ahead(kinematics, spacing, duration=1.6):
    """Compute a log of a robot that stands, rolls ahead, and stands again; rows are `spacing` apart [s]."""
    time = np.arange(0.0, duration, spacing)
    up, down = (np.clip((time - begin) / GOES, 0.0, 1.0) for begin in (REST, STOPS))
    speed = SPEED * (up - down)
    way = np.concatenate(([0.0], np.cumsum(0.5 * spacing * (speed[1:] + speed[:-1]))))
    position, velocity = np.zeros((2, len(time), kinematics.size))
    robot = centauro("mammal_wide_straight")
    names, dofs = list(kinematics.dofs), np.array([list(kinematics.dofs).index(name) for name in robot.dofs[6:]])
    position[:, dofs] = robot.state.position[6:]
    for column, sign in zip((names.index(f"j_{wheel}") for wheel in log_module.WHEELS), (1, -1, 1, -1), strict=True):
        position[:, column], velocity[:, column] = sign * way / RADIUS, sign * speed / RADIUS
    position[:, 0], position[:, 2], velocity[:, 0] = way, 1.0, speed
    before = np.zeros((len(time), 6))
    before[1:, 0] = speed[:-1]
    force = np.tile((0.0, 0.0, 200.0), (len(time), 4, 1))
    return log_module.Log(BEGIN + time, position, velocity, np.zeros_like(position), before, force, np.full(4, RADIUS))


@pytest.fixture(scope="module")
def lines(kinematics):
    """Return the lines of cases on such a log."""
    return list(transport.results(ahead(kinematics, replay.ROW), 1, CASES, BEGIN))


@pytest.fixture(scope="module")
def prompt(kinematics):
    """Return what methods estimate without faults."""
    return estimates(kinematics, None)


def test_each_case_has_its_lines(lines):
    assert len(lines) == len(CASES) * len(transport.SENSORS) * len(transport.OWN)
    assert all(math.isfinite(line["heading_error"]) and math.isfinite(line["position_error"]) for line in lines)
    # 0.2 m is short: a step of the encoders, and joints that were lost at the end, count
    assert all(line["position_error"] < 3.0 for line in lines if line["method"] == "filter")


def test_faults_act_on_the_messages_that_they_name(lines):
    exact = {line["case"]: line for line in lines if (line["sensors"], line["method"]) == ("exact", "filter")}
    assert set(CASES) <= transport.CASES.keys() and not exact["nothing"]["missed"]
    # late messages lose nothing, lost ones do
    assert exact["10 % of joints lost"]["position_error"] != exact["nothing"]["position_error"]


def test_the_table_has_a_row_for_each_case(lines):
    rows = transport.table(lines).splitlines()
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows[2:]] == list(CASES)
    assert len({row.count("|") for row in rows}) == 1


def test_messages_have_rates_of_their_own(kinematics):
    recorded = replay.measure(ahead(kinematics, replay.ROW, 0.1), 1, 1.0, BEGIN)
    assert np.diff([each.stamp for each in recorded.joints]) == pytest.approx(0.005)
    assert np.diff([each.stamp for each in recorded.imu]) == pytest.approx(0.002)
    assert recorded.delay == 0.002


def estimates(kinematics, faults):
    return play.Played(ahead(kinematics, log_module.PERIOD), 1, 0.0, ("filter", "rolling_squares"), faults).estimates


@pytest.mark.parametrize("method", ["filter", "rolling_squares"])
def test_a_transport_delays_what_methods_receive(prompt, kinematics, method):
    """At a constant speed a delay of 50 ms, which is ten cycles, is a way; at the end all has arrived."""
    late = {"delay": 0.05}
    delayed = estimates(kinematics, FaultsRecord.model_validate({"topics": {"joint_states": late, "imu": late}}))[
        method
    ]
    count, moving = len(delayed), round(0.9 / log_module.PERIOD)
    assert len(prompt[method]) - count == 10  # methods begin with the first messages
    before = prompt[method][-count:]
    assert before[moving, 0] - delayed[moving, 0] == pytest.approx(0.05 * SPEED, rel=0.05)
    assert before[-1, 0] == pytest.approx(delayed[-1, 0], abs=2e-3)


def test_a_transport_leaves_out_cycles_of_estimation(prompt, kinematics):
    poses = estimates(kinematics, FaultsRecord.model_validate({"loop": {"skip": 0.5}}))["filter"]
    moving = slice(round(0.6 / log_module.PERIOD), round(1.0 / log_module.PERIOD))
    assert 0.3 < np.mean(np.diff(poses[moving, 0]) == 0.0) < 0.7
    assert poses[-1, 0] == pytest.approx(prompt["filter"][-1, 0], abs=2e-3)


@pytest.mark.parametrize(
    ("program", "text", "error"),
    [
        ("estimation", "topics:\n  imu: {loss: 2.0}\n", "faults.yaml:2:15"),
        ("estimation", "topics:\n  imy: {loss: 0.1}\n", "did you mean: imu"),
        ("driving", "loop: {skip: 2.0}\n", "faults.yaml:1:14"),
    ],
)
def test_a_bad_file_is_one_error(program, text, error, tmp_path, monkeypatch, capsys):
    file = tmp_path / "faults.yaml"
    file.write_text(text)
    monkeypatch.setattr(sys, "argv", [f"{program}.py", "--transport", str(file)])
    monkeypatch.setattr(logging, "disable", lambda _: None)  # the other tests of this process check theirs
    with pytest.raises(SystemExit) as ended:
        part(program).main()
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert error in said and said.count("error:") == 1


def test_arrivals_become_faults():
    arrivals = part("estimation_cases.arrivals")
    stamps, draws = np.arange(2000) * 0.005, np.random.default_rng(1)
    late = draws.uniform(0.0, 0.004, len(stamps))
    kept = draws.uniform(size=len(stamps)) >= 0.02
    joints = arrivals.Stream(stamps[kept], (stamps + 0.3 + late)[kept])
    imu = arrivals.Stream(stamps, stamps + 0.3 + 0.2 * (stamps > 5.0))  # 0.2 s were lost, which is no delay
    assert joints.period == pytest.approx(0.005) and joints.loss == pytest.approx(1.0 - kept.mean(), abs=1e-3)
    assert np.percentile(joints.delays, 99.0) == pytest.approx(0.00396, rel=0.02) and imu.delays.max() < 1e-9
    assert imu.behind == pytest.approx(0.2 / 10.2, rel=1e-3)
    assert 0.02 < arrivals.alone(joints, imu) < 0.6
    made = FaultsRecord.model_validate(yaml.safe_load(arrivals.as_faults({"joint_states": joints, "imu": imu})))
    assert made.topics["*"].jitter == pytest.approx(0.004, rel=0.02) and made.topics["*"].loss > 0.01
