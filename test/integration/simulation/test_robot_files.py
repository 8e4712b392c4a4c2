"""The table of `benchmark/robot_files.py`, on a few robots."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[3] / "benchmark"
ARM, LEGS = "pybullet_data:kuka_iiwa/model", "pybullet_data:a1/a1"


@pytest.fixture
def table(monkeypatch):
    """Load the script."""
    monkeypatch.syspath_prepend(str(BENCHMARK))
    spec = importlib.util.spec_from_file_location("robot_files", BENCHMARK / "robot_files.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(table, monkeypatch, capsys, *arguments):
    """Run it; return its output and the progress."""
    monkeypatch.setattr(sys, "argv", ["robot_files.py", "--duration", "0.5", *arguments])
    table.main()
    return capsys.readouterr()


@pytest.mark.slow
def test_an_arm_and_legs(table, monkeypatch, capsys):
    out, err = run(table, monkeypatch, capsys, "--json", "--seed", "7", ARM, LEGS)
    arm, legs = map(json.loads, out.splitlines())
    assert arm["robot"] == ARM and (arm["dofs"], arm["verdict"], arm["differences"]) == (7, "holds", [])
    assert (legs["dofs"], legs["verdict"]) == (18, "stands")
    assert min(arm["reached"], legs["reached"]) >= 18
    assert [line for line in err.splitlines() if line.startswith(("1/", "2/"))] == [f"1/2 {ARM}", f"2/2 {LEGS}"]


def test_what_cannot_be_loaded_has_its_reason(table, tmp_path):
    (tmp_path / "r.urdf").write_text('<robot name="r"><link/></robot>')
    found = table.examine(tmp_path / "r.urdf", False, 0.1, 1)
    assert found == {"refused": "<link> number 1 has no name"}
    assert table.line("r", found).endswith("refused: <link> number 1 has no name")


def test_a_difference_of_pinocchio_is_named(table, tmp_path):
    """Pinocchio lets a joint without a range stay at zero, as the URDF says, and the description likewise."""
    from solfer.model.kinematics import Kinematics
    from solfer.model.urdf.description import Description

    inertial = '<inertial><mass value="{}"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    text = (
        f'<robot name="r"><link name="a"/><link name="b">{inertial}<collision><geometry><sphere radius="1"/></geometry>'
        '</collision></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        '<limit lower="-1" upper="{}" velocity="1" effort="1"/></joint></robot>'
    )
    path = tmp_path / "r.urdf"
    path.write_text(text.format(2, 1))
    kinematics = Kinematics(Description.from_file(path))
    assert not list(table.pinocchio_differs(kinematics))
    path.write_text(text.format(3, 1.5))
    found = list(table.pinocchio_differs(kinematics))
    assert found == ["mass 2 kg, in Pinocchio 3 kg", "joint 'j': -1 to 1, in Pinocchio -1 to 1.5"]
