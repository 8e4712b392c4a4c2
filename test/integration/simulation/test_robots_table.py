"""Robots of two collections with their own SRDFs: what the table in docs/measurements/robots.md says of each.

HyQ and two more by default, drawn by a seed; `pytest --robots all` takes all, `--robots 7` two others.
"""

import importlib.util
import random
import sys
from pathlib import Path

import pytest

from solfer.errors import SolferError, SolferErrors
from solfer.robot import Robot

ROOT = Path(__file__).parents[3]
ALWAYS, COUNT, DURATION = "hyq", 2, 5.0
WITHOUT_URDF = {"cassie_v2.srdf"}
UNFIT = "baxter"
LEFT_OUT = {
    "hyq": ("group 'all_legs': unknown group 'lf' (did you mean lf_leg?)", "joint 'root_joint' has 7 values"),
    "solo12": ("group 'all_legs': unknown group 'lf'", "joint 'root_joint' has 7 values"),
    "icub": ("group 'l_leg': no chain leads from link 'chest' out to link 'l_sole'",),
    "talos_left_arm": ("group 'r_leg': unknown joint 'leg_right_1_joint'",),
}
SECOND_SRDF = {"pr2_manipulation.srdf", "romeo_moveit.srdf"}  # of a robot that has a row with another one


def load():
    """Load benchmark/robots.py."""
    sys.path.insert(0, str(ROOT / "benchmark"))
    spec = importlib.util.spec_from_file_location("benchmark_robots", ROOT / "benchmark/robots.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rows():
    """Read the lines of the table by the robots' names."""
    lines = (ROOT / "docs/measurements/robots.md").read_text(encoding="utf-8").splitlines()
    begin = next(number for number, line in enumerate(lines) if line.startswith("robot  "))
    end = lines.index("```", begin)
    return {line[:20].strip(): line[20:] for line in lines[begin + 1 : end]}


benchmark = load()


def pytest_generate_tests(metafunc):
    if "drawn" in metafunc.fixturenames:
        chosen = metafunc.config.getoption("robots")
        names = list(benchmark.collections())
        if chosen != "all":
            names.remove(ALWAYS)
            names = [ALWAYS, *random.Random(int(chosen)).sample(names, COUNT)]
        metafunc.parametrize("drawn", names)


def test_the_table_has_every_robot():
    assert list(rows()) == list(benchmark.collections())
    (root,) = {folder for folder, _ in benchmark.collections().values() if folder.name == "robots"}
    used = {Path(robot.srdf).name for _, robot in benchmark.collections().values() if robot.srdf}
    assert {path.name for path in root.rglob("*.srdf")} - used == WITHOUT_URDF | SECOND_SRDF


def test_every_robot_loads_with_its_own_srdf(caplog):
    for name, (folder, robot) in benchmark.collections().items():
        if robot.srdf is None or name == UNFIT:
            continue
        caplog.clear()
        loaded = Robot.load(folder / robot.urdf, folder / robot.srdf, robot.floating)
        for group in loaded.semantics.groups:
            assert set(loaded.links(group)) <= set(loaded.description.links)
        for part in LEFT_OUT.get(name, ()):
            assert part in caplog.text, name


def test_an_srdf_of_which_nothing_fits_is_refused():
    folder, robot = benchmark.collections()[UNFIT]
    with pytest.raises(SolferErrors, match="did you mean: head_pan, head_nod"):
        Robot.load(folder / robot.urdf, folder / robot.srdf, robot.floating)


def test_a_robot_does_what_the_table_says(drawn):
    row = rows()[drawn]
    folder, robot = benchmark.collections()[drawn]
    try:
        found = benchmark.measure(folder, robot, DURATION)
    except SolferError as error:
        assert row == f"refused: {benchmark.why(error)}"
        return
    assert row.split()[:2] == [found["start"] or "-", str(found["dofs"])] and row.endswith(f"  {found['verdict']}")
    if found["verdict"] == "stands":
        assert found["last_mm"] < 5.0  # in the last two seconds
