"""`solfer list`: one line for each entry, with its properties."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from solfer.cli.columns import aligned
from solfer.model import Description, Semantics
from solfer_tools.cli.main import main

CONFIG = Path(__file__).parents[3] / "config"
CENTAURO = CONFIG / "centauro.yaml"
FIGURE_5 = Path(__file__).parents[2] / "data" / "graph_shared.yaml"
URDF, SRDF = (CONFIG / "robots" / "centauro" / f"centauro.{kind}" for kind in ("urdf", "srdf"))


@pytest.fixture(scope="module")
def description():
    return Description.from_file(URDF)


@pytest.fixture(scope="module")
def semantics(description):
    return Semantics.from_file(SRDF, description)


def listed(capsys, *arguments):
    """Return the cells of the lines, by name."""
    assert main(["list", *map(str, arguments)]) == 0
    lines = capsys.readouterr().out.splitlines()
    return {line.split("  ")[0]: [cell.strip() for cell in line.split("  ") if cell.strip()] for line in lines}


def test_joints_have_type_links_and_limits(description, capsys):
    joints = listed(capsys, "joints", "--robot", "centauro")
    assert list(joints) == list(description.joints)
    yaw = description.joints["torso_yaw"]
    limits = [f"{yaw.lower:.4g} to {yaw.upper:.4g} rad", f"{yaw.velocity:.4g} rad/s", f"{yaw.effort:.4g} Nm"]
    assert joints["torso_yaw"] == ["torso_yaw", "revolute", f"{yaw.parent} > {yaw.child}", *limits]
    assert joints["j_wheel_1"][3] == "no end"
    assert joints["reference"] == ["reference", "floating", "world > pelvis"]


def test_links_have_mass_and_neighbours(description, capsys):
    links = listed(capsys, "links", CENTAURO)
    assert list(links) == list(description.links)
    assert links["pelvis"] == [
        "pelvis",
        f"{description.links['pelvis'].mass:.6g} kg",
        "on reference",
        f"carries {len(description.links['pelvis'].children)} joints",
    ]
    assert links["world"][1:3] == ["no mass", "root"]


def test_groups_have_their_sizes(semantics, capsys):
    groups = listed(capsys, "groups", "--urdf", URDF, "--srdf", SRDF)
    assert set(groups) == {"all", *semantics.groups}
    assert groups["wheels"] == ["wheels", "4 joints", "4 links", ", ".join(semantics.groups["wheels"].joints)]
    assert groups["torso"][1] == "1 joint"


def test_states_have_their_first_values(semantics, capsys):
    states = listed(capsys, "states", CENTAURO, "-n", "joint_lower")
    assert list(states) == list(semantics.states)
    values = semantics.states["home"]
    joint, value = next(iter(values.items()))
    assert states["home"][1] == f"{len(values)} joints" and states["home"][2].startswith(f"{joint} {value:.4g}, ")


def test_configurations_have_component_layer_robot_and_pipes(capsys):
    configs = listed(capsys, "configs", CENTAURO)
    assert configs["joint_states"] == ["joint_states", "JointStates", "NRT", "robot joint_space", "controller direct"]
    assert configs["whole_body"][1:4] == ["no algorithm", "NRT", "robot merged"]


def test_declarations_have_kind_interface_and_plugin(capsys):
    declared = listed(capsys, "declarations", CENTAURO, "-n", "manipulation")
    assert declared["manipulation/reference"][1:] == ["service", "solfer/SetReference", "of manipulation"]
    assert declared["manipulation/left/reference"][1:3] == ["topic in", "geometry_msgs/PointStamped"]
    assert declared["manipulation/reach"][1:3] == ["action", "solfer/Reach"]


def test_pipes_have_content_and_users(capsys):
    assert main(["list", "pipes", str(CENTAURO), "-n", "whole_body"]) == 0
    lines = capsys.readouterr().out.splitlines()
    received = next(line for line in lines if line.startswith("upper_body ") and " feedback " in line)
    assert (
        "desired position, velocity" in received and "map RBDL_UPPER" in received and "used by whole_body" in received
    )
    wheels = next(line for line in lines if line.startswith("velocity_controller "))
    assert "velocity_controller/command" in wheels and " wheels " in wheels
    assert set(listed(capsys, "pipes", CENTAURO, "-n", "upper_body")) == {"link_side_online", "upper_body"}


def test_maps_have_their_other_end(capsys):
    maps = listed(capsys, "maps", CENTAURO)
    assert maps["RBDL_UPPER"][1] == "model /robot_upper_body"
    assert maps["FEEDBACK"][1].startswith("topic joint_states ")
    assert {"RBDL", "MODEL", "ACTUATED", "LOWER_LEVEL", "ros_control::position_controller"} <= set(maps)


def test_plugins_are_known_or_from_the_file(capsys):
    assert listed(capsys, "plugins")["joint_states"][1] == "configuration joint_states"
    assert "class solfer.components:Component" in listed(capsys, "plugins", CENTAURO)["whole_body"]


def test_correct_parts_of_a_file_are_listed(tmp_path, capsys, caplog):
    file = tmp_path / "main.yaml"
    file.write_text(FIGURE_5.read_text().replace("robot: upper", "robot: uper"))
    (tmp_path / "graph_whole.yaml").write_text((FIGURE_5.parent / "graph_whole.yaml").read_text())
    configs = listed(capsys, "configs", file)
    assert configs["manipulation"] == ["manipulation", "cannot be used: see `solfer check`"]
    assert configs["locomotion"][1] == "no algorithm"
    assert "has mistakes" in caplog.text
    assert configs["shared"][1] == "shared plugin" and configs["shared"][2].startswith("any::estimation, any::")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["joints"], "FILE, --robot NAME, or --urdf FILE"),
        (["joints", "--robot", "centaur"], "did you mean: centauro?"),
        (["pipes"], "FILE on the command line"),
        (["groups", "--srdf", "robot.srdf"], "--urdf FILE"),
        (["groups", "--urdf", "none.urdf"], "none.urdf: the URDF cannot be read"),
        (["configs", "none.yaml"], "there is no file 'none.yaml'"),
        (["pipes", str(CENTAURO), "-n", "joint_stats"], "did you mean: joint_states"),
    ],
)
def test_missing_arguments_are_reported(arguments, message, capsys):
    assert main(["list", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and message in err


def test_an_unknown_kind_shows_the_known_ones(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["list", "joint"])
    assert caught.value.code == 2 and "joints" in capsys.readouterr().err


@pytest.mark.slow
def test_a_reader_may_stop_early():
    """As in `solfer list links FILE | head -1`."""
    program = (
        "import sys; from solfer_tools.cli.main import main; sys.exit(main(['list', 'links', '--robot', 'centauro']))"
    )
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


def test_cells_of_a_column_begin_at_one_place():
    assert list(aligned([("a", "b"), ("long", "", "c")], indent=" ")) == [" a     b", " long     c"]
    assert list(aligned([])) == []
