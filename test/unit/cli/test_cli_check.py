"""`solfer check`: its output, for readers and for programs, and its exit code."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from solfer_tools.cli.main import main

CONFIG = Path(__file__).parents[3] / "config"
CENTAURO = CONFIG / "centauro.yaml"


@pytest.fixture
def copy(tmp_path):
    """Return a function that copies the shipped configuration with some texts replaced."""

    def make(*replacements):
        shutil.copytree(CONFIG, tmp_path / "config", dirs_exist_ok=True)
        file = tmp_path / "config" / "centauro.yaml"
        text = file.read_text()
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new, 1)
        file.write_text(text)
        return file

    return make


def line_of(file, text):
    return next(number for number, line in enumerate(file.read_text().splitlines(), 1) if text in line)


OURS = ("-n", "joint_states", "-n", "joint_lower", "-n", "whole_body")
"""Configurations whose components exist; others of the file give a warning."""


def test_a_good_configuration_gives_one_line(capsys):
    assert main(["check", str(CENTAURO), *OURS]) == 0
    out, err = capsys.readouterr()
    assert (out, err) == (f"{CENTAURO}: 3 configurations, no errors, no warnings\n", "")


MISTAKES = (
    ("model_change: false    #", "model_chnge: false    #"),
    ("chain: wheels", "chain: weels"),
    ("speed: 0.5 ", "speed: fast "),
)


@pytest.mark.slow
def test_all_mistakes_have_their_places(copy, capsys):
    file = copy(*MISTAKES)
    assert main(["check", str(file)]) == 2
    out, err = capsys.readouterr()
    for text, words in (
        ("model_chnge", "did you mean: model_change"),
        ("chain: weels", "did you mean: wheels"),
        ("speed: fast", "expected a number"),
    ):
        assert any(
            block.startswith(f"error: {file}:{line_of(file, text)}:") and words in block
            for block in re.split(r"\n(?=\S)", err)
        ), (text, err)
    assert re.search(r"configurations, \d+ errors, ", out)


@pytest.mark.slow
def test_json_has_every_mistake_as_an_object(copy, capsys):
    file = copy(*MISTAKES)
    assert main(["check", str(file), "--json", *OURS]) == 2
    out, err = capsys.readouterr()
    assert err == ""
    found = json.loads(out)
    keys = {"severity", "file", "line", "column", "path", "message", "expected", "names"}
    assert all(set(each) == keys for each in found)
    group = next(each for each in found if "weels" in each["message"])
    line = line_of(file, "chain: weels")
    column = file.read_text().splitlines()[line - 1].index("weels") + 1
    assert (group["severity"], group["file"], group["line"], group["column"]) == ("error", str(file), line, column)
    assert group["path"] == "mwoibn.controller.velocity_controller.dofs.chain"
    assert group["message"] == "unknown group 'weels'" and group["names"][0] == "wheels"


def test_json_of_a_good_configuration_is_empty(capsys):
    assert main(["check", str(CENTAURO), *OURS, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_mistakes_of_other_configurations_are_ignored(copy, capsys):
    file = copy(MISTAKES[2])
    assert main(["check", str(file), "-n", "joint_lower", "-n", "whole_body"]) == 0
    assert ": 2 configurations, no errors" in capsys.readouterr().out
    assert main(["check", str(file), "-n", "joint_states"]) == 2


def test_warnings_leave_the_exit_code_at_zero(copy, capsys):
    named = "      class: solfer.components:Component"
    file = copy((named, f"      colour: red\n{named}"))
    assert main(["check", str(file), "-n", "whole_body"]) == 0
    out, err = capsys.readouterr()
    assert err.startswith(f"warning: {file}:") and "colour" in err and "1 warning\n" in out
    assert main(["check", str(file), "-n", "whole_body", "--json"]) == 0
    (warning,) = json.loads(capsys.readouterr().out)
    assert warning["severity"] == "warning" and warning["line"] == line_of(file, "colour")


MAGNITUDES = [
    ("minor_axis: 0.068 ", "minor_axis: 68 ", "wheeled_motion", "wheels have a tube of 0.068 m; 68 mm are 0.068 m"),
    ("slip: 0.03 ", "slip: 30 ", "odometry", "30 cm/s are 0.3 m/s"),
    ("stall: 0.5 ", "stall: 500 ", "odometry", "500 ms are 0.5 s"),
    ("delay: 0.01}", "delay: 10}", "ground_forces", "10 s is 1000 times the default, 0.01 s"),
    ("above: 10,", "above: 10000,", "ground_forces", "more than the robot weighs, 932 N"),
    (
        "      CASTER: 1.5",
        "      CASTER: 500",
        "wheeled_motion",
        "2.5 times the error in each cycle, so that it div",
    ),
    ("speed: 0.5 ", "speed: 30 ", "joint_states", "up to 20.35 rad/s; 30 deg/s are 0.5236 rad/s"),
    ("arm2_7, nearest: 0.06}", "arm2_7, nearest: 6}", "inverse_kinematics", "which spans 2.6 m; 6 mm are 0.006 m"),
]
"""What is written, what stands there instead, the configuration that has it, and words of the warning."""


@pytest.mark.parametrize("written, instead, name, words", MAGNITUDES)
def test_a_number_of_another_unit_is_a_warning(written, instead, name, words, copy, capsys):
    file = copy((written, instead))
    assert main(["check", str(file), "-n", name]) == 0
    err = capsys.readouterr().err
    assert err.startswith(f"warning: {file}:{line_of(file, instead)}:") and words in err and err.count("\n") == 1


@pytest.mark.parametrize(
    "file, kind",
    [
        ("robots/centauro/robot.yaml", "the bundle of a robot"),
        ("robots/centauro/contacts.yaml", "the file of the contacts of a robot"),
        ("studies/hundred.yaml", "a study"),
        ("scenarios/base.yaml", "a scenario"),
        ("worlds/gate.yaml", "a world"),
        ("transport/busy.yaml", "the faults of a transport"),
        ("support/NRT.yaml", "laid over a main configuration"),
    ],
)
def test_a_file_of_another_kind_is_named(file, kind, capsys):
    assert main(["check", str(CENTAURO.parent / file)]) == 2
    err = capsys.readouterr().err
    assert f"this is no main configuration: it is {kind}\n  expected: a main configuration; `" in err


def test_publishers_come_before_their_readers(copy, capsys):
    first = "plugins: [odometry3::odometry, ground_forces, wheeled_motion::locomotion, gravity"
    last = "plugins: [ground_forces, wheeled_motion::locomotion, odometry3::odometry, gravity"
    file = copy((first, last))
    assert main(["check", str(file), "-n", "full_control"]) == 0
    lines = capsys.readouterr().err.splitlines()
    late = "reads 'base_odometry' before 'odometry' publishes it in the same cycle: list it later"
    early = ("ground_forces", "locomotion")
    assert [line.split(": ", 2)[2] for line in lines] == [f"'{name}' {late}" for name in early]


def test_what_is_logged_twice_is_shown_once(capsys, caplog):
    assert main(["check", str(CENTAURO), "-n", "upper_body_ik"]) == 0
    assert caplog.text.count("disturb.ratio: has no effect") == 1


@pytest.mark.slow
def test_files_are_found_below_the_search_path(copy, capsys):
    file = copy(("{file: support/NRT.yaml}", "{path: /opt/elsewhere, file: support/NRT.yaml}"))
    command = ["check", str(file), "-n", "joint_states"]
    assert main(command) == 2
    assert "/opt/elsewhere/support/NRT.yaml" in capsys.readouterr().err
    assert main([*command, "--search-path", str(file.parent)]) == 0


def test_the_system_may_be_another_one(copy, capsys):
    file = copy()
    hardware = file.parent / "support" / "hardware.yaml"
    hardware.write_text(hardware.read_text().replace("calibration: encoders", "calibration: encoder"))
    assert main(["check", str(file), "--system", "SM", "-n", "joint_states"]) == 0
    assert main(["check", str(file), "--system", "HW", "-n", "joint_states"]) == 2
    assert f"error: {hardware}:" in capsys.readouterr().err


def test_the_robot_may_be_another_one(tmp_path, capsys):
    urdf = tmp_path / "crane.urdf"
    urdf.write_text('<robot name="crane"><link name="mast"/></robot>')
    srdf = tmp_path / "crane.srdf"
    srdf.write_text('<robot name="crane"/>')
    assert main(["check", str(CENTAURO), "--urdf", str(urdf), "--srdf", str(srdf)]) == 2
    assert "unknown group 'wheels'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.yaml"], "there is no file 'none.yaml'"),
        ([str(CENTAURO), "-n", "joint_stats"], "did you mean: joint_states"),
        ([str(CENTAURO), "--srdf", "robot.srdf"], "expected: --urdf FILE"),
        ([str(CENTAURO), "--urdf", "none.urdf"], "none.urdf"),
    ],
)
def test_unusable_arguments_are_reported(arguments, message, capsys):
    assert main(["check", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and message in err and "Traceback" not in err


@pytest.mark.slow
def test_it_needs_neither_the_simulation_nor_ros():
    program = (
        "import sys; from solfer_tools.cli.main import main; "
        "absent = dict.fromkeys(('pybullet', 'mujoco', 'rospy', 'matplotlib')); sys.modules |= absent; "
        f"sys.exit(main(['check', {str(CENTAURO)!r}, '-n', 'joint_states']))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("layer", ["xbot.yaml", "xbot_1kHz.yaml"])
def test_a_layer_is_checked_with_its_plugins(layer, capsys):
    assert main(["check", str(CONFIG / layer)]) == 0
    assert capsys.readouterr() == (f"{CONFIG / layer}: 1 configuration, no errors, no warnings\n", "")


@pytest.mark.parametrize(
    ("change", "arguments", "words", "place"),
    [
        (
            ("[joint_states] ", "[joint_sates]"),
            (),
            "unknown plugin 'joint_sates'\n  did you mean: joint_states",
            "xbot",
        ),
        (("[joint_states] ", "[joint_states::shared]"), (), "'shared' lists plugins and is not one itself", "xbot"),
        (("budget:", "budgt:"), (), "unknown key 'budgt'\n  did you mean: budget", "xbot"),
        (("[joint_states] ", "[joint_states] "), ("-n", "joint_state"), "did you mean: joint_states?", "xbot"),
        (("chain: wheels", "chain: weels"), (), "unknown group 'weels'\n  did you mean: wheels", "centauro"),
        (("# rate: 1000 ", "rate: 30 "), (), "half of the rate, 15 Hz", "centauro"),
    ],
)
def test_mistakes_of_a_layer_have_their_places(copy, change, arguments, words, place, capsys):
    filtered = "filter: {run: true, frequency: 20}\n        initialize: true "
    folder = copy(("initialize: true ", filtered)).parent
    right, wrong = change
    file = next(each for each in (folder / "xbot.yaml", folder / "centauro.yaml") if right in each.read_text())
    file.write_text(file.read_text().replace(right, wrong, 1))
    assert main(["check", str(folder / "xbot.yaml"), *arguments]) == 2
    errors = capsys.readouterr().err
    assert words in errors and f"{folder / place}.yaml:" in errors and "Traceback" not in errors
