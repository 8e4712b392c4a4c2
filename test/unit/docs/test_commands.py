"""The commands of the pages: those of `solfer` run here in the order of their page, others in tests named here."""

import argparse
import re
import shlex

import pytest
from support.modules import forget

from solfer_tools.cli.main import main, parser


def sub_command(parser, words):
    """Return the parser of the sub-command that some words begin with, and the words behind its name."""
    while subs := next(
        (each.choices for each in parser._actions if isinstance(each, argparse._SubParsersAction)), None
    ):
        if not words or words[0] not in subs:
            break
        parser = subs[words[0]]
        words = words[1:]
    return parser, words


BLOCK = re.compile(r"^```(?:sh|bash|console)\n(.*?)^```", re.MULTILINE | re.DOTALL)
SYNOPSIS = re.compile(r"\b(FILE|NAME|URDF|REASON|SECONDS)\b")

ELSEWHERE = {
    r"\./run demo": ("test/integration/paper/test_demo.py", "demo"),
    r"\./run check": ("test/integration/package/test_run.py", '"check"'),
    r"\./run test( .*)?": ("test/unit/docs/test_commands.py", "test_paths_of_tests_exist"),
    r"\./run exec python examples/policy/.*": ("test/integration/plugins/test_policy_example.py", "level.py"),
    r"\./run exec python examples/.*": ("test/integration/paper/test_examples.py", "examples"),
    r"\./run exec python benchmark/gallery.py .*": ("test/integration/simulation/test_gallery.py", "gallery.py"),
    r"\./run exec rosrun plugins plugin -p nod .*": ("test/unit/docs/test_recipes.py", '"Nod"'),
    r"\./run exec solfer check config/centauro.yaml": ("test/unit/cli/test_cli_check.py", "CENTAURO"),
    r"(python3 -m venv|\. ~/|mkdir -p ~/|git clone URL|sudo apt-get|pip install -r|catkin_make -C ~/).*": (
        "test/integration/package/test_bare_debian.py",
        "page[0]",
    ),
    r"solfer new component swing_joint --package .*": (
        "test/integration/package/test_install_space.py",
        "new component swing_joint",
    ),
    r"solfer new component swing_joint --cpp": ("test/integration/package/test_new_component.py", '"--cpp"'),
    r"roslaunch solfer joint_states.launch": ("test/integration/package/test_install_space.py", "joint_states.launch"),
    r"python3 -m pytest swing_joint": ("test/integration/package/test_new_component.py", '"-m", "pytest"'),
    r"roslaunch swing_joint .*": ("test/integration/package/test_new_component.py", "launch/swing_joint.launch"),
    r"solfer new robot my_robot .*": ("test/integration/package/test_new_robot.py", '"new", "robot"'),
    r"python3 -m pytest my_robot": ("test/integration/package/test_new_robot.py", '"-m", "pytest"'),
    r"roslaunch my_robot .*": ("test/integration/package/test_new_robot.py", "launch_files"),
    r'eval "\$\(solfer completion\)"': ("test/unit/cli/test_cli_completion.py", '"completion"'),
    r"roslaunch solfer simulation.launch.*": ("test/ros/table_1.test", "simulation.launch"),
    r"roslaunch solfer figure_[1-4].launch( rate:=200| middleware:=XBOT| motion:=joints)?": (
        "test/integration/paper/test_figure_launches.py",
        "figure_",
    ),
    r"roslaunch solfer figure_5.launch rviz:=true": ("test/integration/simulation/test_rviz.py", "rviz:=true"),
    r"roslaunch solfer hardware.launch": ("test/ros/hardware.test", "launch/hardware.launch"),
    r"roslaunch solfer rviz.launch": ("test/unit/cli/test_cli_launch.py", "rviz.launch"),
    r"./run exec python benchmark/rviz.py .*": ("test/integration/simulation/test_rviz.py", "benchmark/rviz.py"),
    r"roslaunch solfer figure_5.launch lockstep:=true .*": ("test/ros/figure_5.test", "lockstep"),
    r"rosservice call /joint_states/[gs]et_parameters .*": ("test/ros/config_test.py", "live_parameters.md"),
    r"rosservice call /desired_tasks/reference .*": ("test/integration/paper/test_figure_3.py", "figures.md"),
    r"rosservice call /(desired_joints|gravity_compensation)/.*": ("test/ros/compensation_test.py", "compensation.md"),
    r"roslaunch solfer figure_4.launch motion:=joints merging:=.*": (
        "test/integration/paper/test_figure_launches.py",
        "merging",
    ),
    r"roslaunch solfer figure_4.launch motion:=joints lockstep:=true .*": ("test/ros/figure_4.test", "lockstep"),
    r"python examples/arm_driver.py my_robot/.*": ("test/integration/package/test_arm_driver.py", "arm_driver.py"),
    r"python examples/ros_control_arm.py": ("test/ros/ros_control_test.py", "ros_control_arm.py"),
    r"rosrun plugins plugin -p .* --system HW": ("test/ros/ros_control_test.py", "ros_control.md"),
    r'rosservice call /joint_states/trajectory "{joints: .elbow.*': ("test/ros/ros_control_test.py", "ros_control.md"),
    r'rosservice call /inverse_kinematics/reference "{task: tip.*': ("test/ros/ros_control_test.py", "ros_control.md"),
    r"rosrun plugins plugin -p joint_states -c my_robot/.*": (
        "test/integration/package/test_arm_driver.py",
        '"joint_states"',
    ),
    r"rosrun plugins plugin -p joint_states": ("test/ros/joint_states.test", "joint_states"),
    r"rosrun solfer simulator --robot .*": ("test/ros/bare_robot_test.py", "--robot"),
    r"rosrun solfer xbot_simulator": ("test/support/integration/xbot_system.py", "xbot_simulator"),
    r"rosrun solfer xbot config/xbot.yaml": ("test/support/integration/xbot_system.py", "xbot"),
    r"ros.*[=/](red|blue)\b.*": ("test/ros/two_robots_test.py", "ros_tools.md"),
    r"rosrun solfer navigation (play|go) .*": ("test/ros/navigation_test.py", '"play"'),
    r"rosrun solfer navigation reference config/references/tip.yaml": (
        "test/integration/package/test_new_robot_tasks.py",
        "rosrun solfer navigation reference",
    ),
    r"rosrun solfer navigation reference .*": ("test/ros/inverse_kinematics_test.py", "navigation reference"),
    r"rosrun solfer navigation cross .*": ("test/ros/stepping_test.py", "navigation (cross"),
    r"roslaunch solfer wheeled_motion.launch name:=stepping( world:=step)?": ("test/ros/stepping.test", "stepping"),
    r"rosservice call /stepping/step .*": ("test/ros/stepping_test.py", "wheeled_motion.md"),
    r"roslaunch solfer wheeled_motion.launch": ("test/ros/wheeled_motion.test", "wheeled_motion.launch"),
    r"rostopic pub -r 10 /wheeled_motion/cmd_vel .*": ("test/ros/wheeled_motion_test.py", "wheeled_motion.md"),
    r"roslaunch solfer ground_forces.launch": ("test/ros/ground_forces.test", "ground_forces.launch"),
    r"rostopic echo -n 1 /ground_forces/.*": ("test/ros/ground_forces_test.py", "ground_forces.md"),
    r"roslaunch solfer inverse_dynamics.launch": ("test/ros/inverse_dynamics.test", "inverse_dynamics.launch"),
    r"roslaunch solfer inverse_kinematics.launch": ("test/ros/inverse_kinematics.test", "inverse_kinematics.launch"),
    r"rosservice call /manipulation/reference .*": ("test/ros/inverse_kinematics_test.py", "inverse_kinematics.md"),
    r"rosservice call /inverse_kinematics/reference .*": (
        "test/integration/package/test_new_floating_robot.py",
        "bring_your_robot.md",
    ),
    r"solfer view .*": ("test/integration/view/test_view.py", "view.md"),
    r"solfer study .*": ("test/integration/study/test_studies.py", "studies.md"),
    r"\./run exec python benchmark/studies.py": ("test/integration/study/test_studies.py", "studies.py"),
    r"solfer params .*": ("test/ros/config_test.py", '"params"'),
    r"solfer top .*": ("test/ros/config_test.py", '"top"'),
    r"solfer rt .*": ("test/unit/cli/test_cli_rt.py", "switch"),
    r"solfer record -n joint_states run.mcap": ("test/ros/motion_test.py", '"record", "-n"'),
    r"solfer record ros.1000.11311 run.mcap": ("test/integration/realtime/test_recordings.py", '"record", namespace'),
    r"rosservice call /joint_states/trajectory .*": ("test/ros/motion_test.py", "README.md"),
    r"rosservice call /(upper|lower)_body/trajectory .*": ("test/ros/figure_4_test.py", "shared_control.md"),
    r"roslaunch solfer figure_4.launch motion:=joints namespace:=.*": (
        "test/ros/namespaces_test.py",
        "roslaunch solfer",
    ),
    r"rosservice call /left/.*": ("test/ros/namespaces_test.py", "rosservice call /left/"),
    r"rosservice call /lower_level/.*": ("test/ros/refused_test.py", "emergency_stop"),
    r"rosservice call /NAME/get_config .*": ("test/ros/config_test.py", "get_config"),
    r"(\./run ros2 .*|sed .* config/ros2.yaml)": ("test/unit/ros2/test_ros2_plugin.py", "docs/how-to/ros2.md"),
    r"pip install \..*": ("test/integration/package/test_pip_install.py", "install"),
    r'pip install "\.\[.*': ("test/integration/package/test_pip_install.py", "install"),
    r"pytest test/unit --without ros": ("test/integration/package/test_pip_install.py", "without"),
}
"""Commands that need ROS, PyBullet, a network or minutes: the test that runs each of them, and a word of it."""


def commands(text):
    """Return the commands of a page, in order, without comments and output."""
    found = []
    for block in BLOCK.findall(text):
        lines = block.replace("\\\n", " ").splitlines()
        console = any(line.startswith("$ ") for line in lines)
        found += [line.removeprefix("$ ") for line in lines if line.strip() and (not console or line.startswith("$ "))]
    return [re.sub(r"\s+#.*", "", line).strip() for line in found]


def test_file_of(command):
    """Return the file of the test that runs a command elsewhere, and a word that it has; None if there is none."""
    return next((place for pattern, place in ELSEWHERE.items() if re.fullmatch(pattern, command)), None)


test_file_of.__test__ = False


@pytest.fixture(scope="module")
def pages(repository):
    """Read the commands of each page."""
    files = [repository / "README.md", repository / "CONTRIBUTING.md", *sorted((repository / "docs").rglob("*.md"))]
    return {str(file.relative_to(repository)): commands(file.read_text()) for file in files}


@pytest.fixture
def scratch(repository, tmp_path, monkeypatch):
    """Make a folder in which the commands of a page find what the repository has."""
    for name in ("config", "examples"):
        (tmp_path / name).symlink_to(repository / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_commands_of_solfer_run_in_order(pages, scratch, capsys):
    ran = []
    for page, lines in pages.items():
        made = {path.name for path in scratch.iterdir()}
        for line in lines:
            if line.startswith("solfer ") and not SYNOPSIS.search(line) and test_file_of(line) is None:
                assert main(shlex.split(line)[1:]) == 0, (page, line, capsys.readouterr().err)
                ran.append(line)
        for path in scratch.iterdir():  # the next page begins without them
            if path.name not in made:
                path.rename(scratch / f".{page.replace('/', '_')}_{path.name}")
        forget("swing_joint")
    assert len(ran) >= 6 and any(line.startswith("solfer new") for line in ran)


def test_every_other_command_is_run_by_a_test(pages, repository):
    lost, wrong = [], []
    for page, lines in pages.items():
        for line in lines:
            if line.startswith("solfer ") and test_file_of(line) is None:
                continue
            place = test_file_of(line)
            if place is None:
                lost.append((page, line))
            elif place[1] not in (repository / place[0]).read_text():
                wrong.append((page, line, place))
    assert (lost, wrong) == ([], [])


def test_synopses_name_commands_and_options_that_exist(pages):
    seen = 0
    for page, lines in pages.items():
        for line in (line for line in lines if line.startswith("solfer ") and SYNOPSIS.search(line)):
            words = re.sub(r"[\[\]|]|\.\.\.", " ", line).split()[1:]
            command, rest = sub_command(parser(), words)
            assert isinstance(command, argparse.ArgumentParser) and rest != words, (page, line)
            known = {name for action in command._actions for name in action.option_strings}
            known |= {name.replace("--", "--no-", 1) for name in known}
            assert {word for word in rest if re.fullmatch(r"--?[a-z][\w-]*", word)} <= known, (page, line)
            seen += 1
    assert seen >= 10


def test_paths_of_tests_exist(pages, repository):
    lines = [line for page in pages.values() for line in page if line.startswith("./run test ")]
    new = {"test/integration/physics/test_sensors_tracker.py"}  # of a recipe
    paths = {word for line in lines for word in shlex.split(line) if word.startswith("test/")}
    assert len(lines) >= 5 and {path for path in paths if not (repository / path).exists()} == new


def test_page_texts_are_read_as_a_shell_would():
    text = "```sh\nsolfer a  # b\n```\n```console\n$ solfer c\nerror: d\n```\n```python\nsolfer e\n```\n"
    assert commands(text) == ["solfer a", "solfer c"]
