"""`solfer launch`: arguments of launch files, which roslaunch does not check. One of them runs as a user starts it."""

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from solfer_tools.cli.commands.launch import known_to, started
from solfer_tools.cli.main import main

LAUNCH = Path(__file__).parents[3] / "launch"
FILES = sorted(LAUNCH.glob("*.launch"))
TEMPLATES = sorted((LAUNCH.parent / "src/solfer_tools/cli/templates").glob("*/*.launch.in"))


@pytest.mark.parametrize("file", [*FILES, *TEMPLATES], ids=lambda file: file.name)
def test_each_launch_file_checks_its_arguments_first(file):
    """The check stands before all that starts something; those of the figures have it in common."""
    places = ("launch", "arg", "group", "remap")  # which start nothing
    elements = [each for each in ElementTree.parse(file).iter() if each.tag not in places]
    if file.name.startswith("figure_"):
        assert elements[0].get("file").endswith("/figure.launch")
        return
    name = {"figure.launch": "figure_$(arg figure).launch"}.get(file.name, file.name.replace(".launch.in", ".launch"))
    command = elements[0].get("command", "")
    name = "@NAME@.launch" if file in TEMPLATES else name
    assert elements[0].tag == "param" and "solfer launch '$(find" in command and f"/launch/{name}'" in command


def test_robots_that_float_start_without_a_warning():
    """robot_state_publisher warns of floating joints by the logger of kdl_parser, which a file makes silent."""
    nodes = [each for file in (*FILES, *TEMPLATES) for each in ElementTree.parse(file).iter("node")]
    files = [each.find("env").get("value") for each in nodes if each.get("type") == "robot_state_publisher"]
    assert files == 3 * ["$(find solfer)/launch/robot_state_publisher.config"]
    assert "log4j.logger.ros.kdl_parser=ERROR\n" in (LAUNCH / "robot_state_publisher.config").read_text()


@pytest.mark.parametrize("file", TEMPLATES, ids=lambda file: file.name)
def test_launch_files_of_new_packages_can_record(file):
    assert known_to(file)["record"] == ""
    names = ("simulation.launch", "rviz.launch", "view.launch")
    includes = [each for each in ElementTree.parse(file).iter("include") if not each.get("file").endswith(names)]
    assert includes
    for each in includes:
        assert each.find("arg[@name='record']").get("value") == "$(arg record)"


@pytest.mark.parametrize(
    ("file", "argument", "said"),
    [
        ("joint_states", "wrold:=ice", "joint_states.launch: unknown argument 'wrold'\n  did you mean: world"),
        ("joint_states", "robot:=centaur", "unknown robot 'centaur'\n  did you mean: centauro?"),
        ("inverse_kinematics", "state:=homming", "unknown state 'homming'"),
        ("wheeled_motion", "config:=none.yaml", "wheeled_motion.launch, config: there is no file 'none.yaml'"),
        ("wheeled_motion", "namespace:=/red", "'/red' is no namespace"),
        ("wheeled_motion", "lockstep:=maybe", "unknown value of lockstep 'maybe'"),
        ("ground_forces", "rates:=joint=5", "unknown rate 'joint'"),
        ("simulation", "factor:=-1", "factor is '-1'"),
        ("hardware", "mock:=none.yaml", "there is no file 'none.yaml'\n  expected: the file of a mock"),
        ("figure_5", "rviz:=yes", "unknown value of rviz 'yes'"),
        ("mock", "gui:=yes", "unknown value of gui 'yes'"),
        ("robot", "urdf:=none.urdf", "there is no file 'none.urdf'\n  expected: a URDF"),
        ("plugin", "system:=SN", "unknown value of system 'SN'"),
        ("record", "record:=nowhere/run.mcap", "there is no folder 'nowhere'"),
        ("xbot", "rate:=fast", "rate is 'fast'"),
        ("xbot", "world:=flaat", "unknown world 'flaat'"),
    ],
)
def test_a_wrong_argument_is_one_error(file, argument, said, capsys):
    assert main(["launch", f"{LAUNCH}/{file}.launch", argument]) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("error: ") == 1


def test_right_arguments_are_accepted(capsys, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: name)  # RViz need not be there
    right = {
        "simulation": ["lockstep:=upper_body, lower_body", "state:=home_compact", "factor:=0", "rates:=joints=500"],
        "xbot": ["system:=HW", "rate:=", "record:=run.mcap"],
        "plugin": ["system:=", "name:=joint_online"],
        "rviz": [f"robot:={LAUNCH.parent}/config/robots/centauro/robot.yaml"],
    }
    for name, arguments in right.items():
        assert main(["launch", f"{LAUNCH}/{name}.launch", *arguments]) == 0
        assert capsys.readouterr().out == f"{name}.launch\n"


@pytest.mark.parametrize(
    ("name", "missing", "remedy"),
    [("rviz", "program 'rviz'", "apt-get install rviz"), ("view", "module 'viser'", "requirements-view.txt")],
)
def test_what_a_launch_lacks_is_one_error(monkeypatch, capsys, name, missing, remedy):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("solfer_tools.cli.commands.launch.find_spec", lambda name: None)
    assert main(["launch", f"{LAUNCH}/{name}.launch"]) == 2
    err = capsys.readouterr().err
    assert f"error: {name}.launch: there is no {missing}" in err and remedy in err


@pytest.mark.parametrize("file", [*FILES, *TEMPLATES], ids=lambda file: file.name)
@pytest.mark.parametrize("shown", ["rviz", "view"])
def test_rviz_and_page_start_once_if_they_are_asked_for(file, shown):
    """Each file with a robot hands both on to what it includes, down to the one that describes the robot."""
    parts = ("plugin.launch", "record.launch", "rviz.launch", "view.launch")  # which run beside a robot
    assert (shown in known_to(file)) == (file.name not in parts)
    for include in ElementTree.parse(file).iter("include"):
        name = include.get("file").rpartition("/")[2]
        if name not in parts and not include.get("pass_all_args"):
            assert include.find(f"arg[@name='{shown}']").get("value") == f"$(arg {shown})", name


def test_a_file_that_is_no_launch_file_is_refused(tmp_path, capsys):
    (tmp_path / "a.launch").write_text("<launch>")
    assert main(["launch", f"{tmp_path}/a.launch"]) == 2
    assert "a.launch: the launch file cannot be read" in capsys.readouterr().err


def test_another_launch_file_of_the_same_name_is_not_meant(tmp_path):
    """The command line of a process that stands for roslaunch, with a package, and with the path of another file."""
    other = tmp_path / "robot.launch"
    other.write_text("<launch/>")
    for words, known in (
        (["solfer", "robot.launch", "robt:=a"], ["robot.launch", "robt:=a"]),
        (["my_robot", "robot.launch", "robt:=a"], []),
        ([str(other), "robt:=a"], []),
        ([str(LAUNCH / "robot.launch"), "robt:=a"], [str(LAUNCH / "robot.launch"), "robt:=a"]),
    ):
        command = [sys.executable, "-c", "print(flush=True); input()", *words]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            process.stdout.readline()  # its command line is there
            assert [word for word in started(process.pid, LAUNCH / "robot.launch") if word] == known
            process.communicate(b"\n")


@pytest.mark.slow
def test_roslaunch_ends_with_the_error():
    command = ["roslaunch", "--nodes", "solfer", "joint_states.launch", "wrold:=ice"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stderr.count("error: ") == 1, done.stderr
    assert "error: joint_states.launch: unknown argument 'wrold'" in done.stderr
