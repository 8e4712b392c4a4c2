"""Estimators beside a robot that drives on sensors which err; longer: benchmark/estimation.py."""

import json
import sys

import pytest
from support.estimation import part

part("estimation_cases.log")
pytestmark = pytest.mark.soak
METHODS = ("filter", "geometric", "rolling_squares", "point_contacts")


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Return the figures of all methods after half a metre, as the benchmark prints them, and its files."""
    folder = tmp_path_factory.mktemp("course")
    (folder / "ahead.yaml").write_text("legs: [{x: 0.6}]\n")
    options = ["--course", str(folder / "ahead.yaml"), "--seed", "3", "--noise", "1", "--logs", str(folder / "logs")]
    patch, printed = pytest.MonkeyPatch(), []
    with patch.context() as patched:
        patched.setattr(sys, "argv", ["estimation.py", "--json", *options, "--picture", str(folder / "paths.png")])
        patched.setattr("builtins.print", lambda *line, file=None, **_: printed.append(line[0]) if not file else None)
        code = part("estimation").main()
    return {line["method"]: line for line in map(json.loads, printed)}, folder, code


@pytest.mark.parametrize("method", METHODS)
def test_the_base_is_where_wheels_have_carried_it(driven, method):
    line = driven[0][method]
    assert 0.55 < line["length"] < 0.65
    # what one step of the encoders and a cycle of delay make of so short a way; `point_contacts` learns slip first
    assert line["end_error"] < (0.08 if method == "point_contacts" else 0.05) and line["height_error"] < 0.01


def test_the_heading_of_the_filter_does_not_drift(driven):
    assert driven[0]["filter"]["heading_error"] < 0.2
    assert 0.0 < driven[0]["filter"]["anees_velocity"] < 4.0


def test_forces_carry_the_weight(driven):
    assert driven[0]["filter"]["force_error"] < 0.05 and driven[0]["filter"]["contact_right"] > 0.98


def test_the_log_and_the_picture_are_kept(driven):
    _, folder, _ = driven
    assert (folder / "paths.png").stat().st_size > 5000
    logged = part("estimation_cases.log").Log.load(folder / "logs/ahead-3.npz")
    assert len(logged.time) == len(logged.position) == len(logged.force) > 2600


def test_the_exit_code_tells_of_missed_goals(driven):
    lines, _, code = driven
    part("estimation")
    goals = part("estimation_cases.courses").COURSES["lap"].goals
    assert code == int(any(lines["filter"][key] > most for key, most in goals.items()))
