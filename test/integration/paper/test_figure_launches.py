"""The launch files figure_1 to figure_5: which nodes they start, and which arguments they refuse."""

import re
import subprocess
from pathlib import Path

import pytest
from rosgraph.names import resolve_name
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

from solfer_tools.cli.main import main

REPOSITORY = Path(__file__).parents[3]

PLUGINS = {
    1: {"joint_states"},
    2: {"manipulation"},
    3: {"desired_tasks", "gravity_compensation"},
    4: {"hands", "odometry", "locomotion", "shared_compensation"},
    5: {"hands", "full_control"},
}
LAYER = {"xbot", "xbot_bridge", "xbot_simulator", "xbot_watchdog", "robot_state_publisher"}


def nodes(figure, *arguments):
    """Return the exit code of `roslaunch --nodes`, the names of the nodes, and what it says besides."""
    command = ["roslaunch", "--nodes", "solfer", f"figure_{figure}.launch", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, {name.lstrip("/") for name in done.stdout.split()}, done.stderr


@pytest.mark.daily(1)
@pytest.mark.parametrize("figure", PLUGINS)
def test_each_figure_starts_its_plugins(figure):
    assert nodes(figure) == (0, {*PLUGINS[figure], "simulator", "robot_state_publisher"}, "")


@pytest.mark.soak
def test_one_argument_moves_them_to_other_places():
    assert nodes(4, "middleware:=XBOT", "rate:=200")[1] == LAYER
    assert nodes(3, "system:=HW", "rate:=200")[1] == {*PLUGINS[3], "hardware"}
    assert nodes(2, "record:=out.mcap")[1] >= {"recorder"}


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    ("page", "merging"), [("reference/compensation", "shared_compensation"), ("how-to/shared_control", "whole_body")]
)
def test_figure_4_starts_with_the_merging_of_the_page(repository, page, merging):
    text = (repository / "docs" / f"{page}.md").read_text()
    (argument,) = re.findall(r"^roslaunch solfer figure_4.launch (motion:=joints merging:=.*)$", text, re.MULTILINE)
    parts = {"upper_body", "lower_body", "simulator", "robot_state_publisher"}
    assert nodes(4, *argument.split()) == (0, {*parts, merging}, "")


@pytest.mark.parametrize("middleware", ["ROS", "XBOT"])
def test_all_names_of_a_figure_are_in_its_namespace(middleware, monkeypatch):
    """Nodes, parameters, and what has a global name by itself; two figures share no name on one master."""
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:9")
    config = ROSLaunchConfig()
    file = str(REPOSITORY / "launch" / "figure_5.launch")
    arguments = [f"middleware:={middleware}", "namespace:=left", "record:="]
    XmlLoader(resolve_anon=False).load(file, config, argv=[file, *arguments], verbose=False)
    assert {node.namespace for node in config.nodes} == {"/left/"}
    for node in config.nodes:
        places = {name: resolve_name(target, f"/left/{node.name}") for name, target in node.remap_args}
        assert places == {f"/{name}": f"/left/{name}" for name in ("diagnostics", "tf", "tf_static")}, node.name
    assert all(name.startswith("/left/") for name in config.params if not name.startswith("/rosdistro")), config.params
    if middleware == "XBOT":
        named = [node for node in config.nodes if node.package == "solfer"]
        assert named and all("--namespace left" in node.args for node in named)


def test_an_argument_that_is_not_there_is_refused():
    code, found, said = nodes(5, "lokstep:=true")
    assert (code, found) == (1, set())
    assert "error: figure_5.launch: unknown argument 'lokstep'\n  did you mean: lockstep?" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["middleware:=ros"], "middleware:=ros: unknown value of middleware 'ros'\n  did you mean: ROS?"),
        (["rate:=fast"], "rate:=fast: rate is 'fast'\n  expected: a number from 1 to 4000 [Hz]"),
        (["motion:=joint"], "unknown argument 'motion'"),
        (["gui:=maybe"], "unknown value of gui 'maybe'\n  expected: one of true, false"),
        (["world:=flaat"], "unknown world 'flaat'\n  did you mean: flat?"),
        (["record:=nowhere/run.mcap"], "there is no folder 'nowhere'\n  expected: a file in a folder"),
        (
            ["middleware:=XBOT", "lockstep:=true"],
            "lockstep with middleware:=XBOT\n  expected: lockstep with middleware:=ROS",
        ),
        (["system:=HW", "world:=ice"], "world with system:=HW\n  expected: world with system:=SM alone"),
        (["merging:=whole_body"], "unknown argument 'merging'"),
        (["namespace:=2nd"], "'2nd' is no namespace\n  expected: a letter"),
        (["namespace:=left", "lockstep:=true"], "lockstep with a namespace"),
    ],
)
def test_a_wrong_value_is_refused(arguments, said, repository, capsys):
    assert main(["launch", f"{repository}/launch/figure_5.launch", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_right_values_are_accepted(repository, capsys):
    right = ["motion:=joints", "merging:=whole_body", "gui:=True", "rate:=", "factor:=0", "lockstep:=true"]
    assert main(["launch", f"{repository}/launch/figure_4.launch", *right]) == 0
    assert capsys.readouterr().out == "figure_4.launch\n"
