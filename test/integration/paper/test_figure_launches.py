"""The launch files figure_1 to figure_5: which nodes they start, and which arguments they refuse."""

import re
import subprocess

import pytest

from solfer.cli.main import main

PLUGINS = {
    1: {"joint_states"},
    2: {"manipulation"},
    3: {"desired_joints", "gravity_compensation"},
    4: {"upper_body", "lower_body", "shared_compensation"},
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
    ("page", "merging"), [("compensation", "shared_compensation"), ("shared_control", "whole_body")]
)
def test_figure_4_starts_with_the_merging_of_the_page(repository, page, merging):
    text = (repository / "docs" / f"{page}.md").read_text()
    (argument,) = re.findall(r"^roslaunch solfer figure_4.launch (merging:=.*)$", text, re.MULTILINE)
    parts = {"upper_body", "lower_body", "simulator", "robot_state_publisher"}
    assert nodes(4, argument) == (0, {*parts, merging}, "")


def test_an_argument_that_is_not_there_is_refused():
    code, found, said = nodes(5, "lokstep:=true")
    assert (code, found) == (1, set())
    assert "error: figure_5.launch: unknown argument 'lokstep'\n  did you mean: lockstep?" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["middleware:=ros"], "middleware:=ros: unknown value of middleware 'ros'\n  did you mean: ROS?"),
        (["rate:=fast"], "rate:=fast: rate is 'fast'\n  expected: a number from 1 to 4000 [Hz]"),
        (["gui:=maybe"], "unknown value of gui 'maybe'\n  expected: one of true, false"),
        (["world:=flaat"], "unknown world 'flaat'\n  did you mean: flat?"),
        (["record:=nowhere/run.mcap"], "there is no folder 'nowhere'\n  expected: a file in a folder"),
        (
            ["middleware:=XBOT", "lockstep:=true"],
            "lockstep with middleware:=XBOT\n  expected: lockstep with middleware:=ROS",
        ),
        (["system:=HW", "world:=ice"], "world with system:=HW\n  expected: world with system:=SM alone"),
        (["merging:=whole_body"], "unknown argument 'merging'"),
    ],
)
def test_a_wrong_value_is_refused(arguments, said, repository, capsys):
    assert main(["launch", f"{repository}/launch/figure_5.launch", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_right_values_are_accepted(repository, capsys):
    right = ["merging:=whole_body", "gui:=True", "rate:=", "factor:=0", "lockstep:=true"]
    assert main(["launch", f"{repository}/launch/figure_4.launch", *right]) == 0
    assert capsys.readouterr().out == "figure_4.launch\n"
