"""What runs is what the file says: the log of a start, and nodes that refuse what is not for them."""

import logging
import runpy
import sys
from pathlib import Path

import pytest

from solfer.config import load, load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.errors import ConfigError, UnknownName
from solfer.plugins import Registry, check_file, generate
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.plugins.generation.runners import require_ros
from solfer.robot.description.shipped import robot_files

REPOSITORY = Path(__file__).resolve().parents[3]
CONFIG = REPOSITORY / "config"
LINE = 1 + (CONFIG / "centauro.yaml").read_text().partition("      layer: NRT\n")[0].count("\n")
"""Where `layer` of joint_states stands, the first module of the file."""

LAYER = "XBotRTPlugins: {plugins: [PLUGINS]}\nmwoibn: {config_file: {file: main.yaml}}\n"


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write a copy of the shipped main configuration with changes, as main.yaml of the working directory."""
    for name in ("support", "robots", "references"):
        (tmp_path / name).symlink_to(CONFIG / name)
    monkeypatch.chdir(tmp_path)

    def written(*changes):
        text = (CONFIG / "centauro.yaml").read_text()
        for right, wrong in changes:
            assert right in text
            text = text.replace(right, wrong, 1)
        Path("main.yaml").write_text(text)
        return "main.yaml"

    return written


def node(name, *arguments):
    """Run the main function of a node in this process, as far as it gets without a master."""
    return runpy.run_path(str(REPOSITORY / "nodes" / name))["main"](list(arguments))


IN_RT = ("      layer: NRT\n", "      layer: RT\n")  # the first one in the file: of joint_states
SHARED_IN_RT = "layer: NRT\n      plugins:", "layer: RT\n      plugins:"
ON_XBOT = ("middleware: ROS", "middleware: XBOT")
ON_ROS2 = ("middleware: ROS", "middleware: ROS2")


@pytest.mark.parametrize(
    ("change", "place", "words"),
    [
        (IN_RT, f"main.yaml:{LINE}:14: mwoibn.modules.joint_states.layer", ("layer RT", "`layer: NRT`")),
        (ON_XBOT, "main.yaml:12:15: mwoibn.middleware", ("middleware XBOT", "`middleware: ROS`")),
    ],
)
def test_a_node_refuses_what_runs_elsewhere(write, change, place, words):
    file = write(change)
    with pytest.raises(ConfigError, match=words[0]) as error:
        node("plugin", "plugin", "-p", "joint_states", "-c", file)
    assert error.value.where == place and words[1] in error.value.expected
    assert "a file LAYER that lists 'joint_states'" in error.value.expected and error.value.exit_code == 2


def test_a_node_under_ros_names_the_command_for_ros_2(write):
    file = write(ON_ROS2)
    with pytest.raises(ConfigError, match="middleware ROS2, and this node runs the layer NRT on ROS") as error:
        node("plugin", "plugin", "-p", "joint_states", "-c", file)
    assert f"`./run ros2 plugin -p ID -n joint_states -c {file}`" in error.value.expected


def test_the_layer_that_lists_it_is_named(write):
    file = write(ON_XBOT)
    Path("a_layer.yaml").write_text(LAYER.replace("PLUGINS", "lower_body"))
    Path("b_layer.yaml").write_text(LAYER.replace("PLUGINS", "joint_states"))
    with pytest.raises(ConfigError) as error:
        node("plugin", "plugin", "-p", "joint_states", "-c", file)
    assert "`rosrun solfer xbot b_layer.yaml`" in error.value.expected
    assert [each.configuration.name for each in read_layer("b_layer.yaml").load()] == ["joint_states"]


@pytest.mark.slow
def test_a_check_says_what_a_node_refuses(write):
    report = check_file(write(IN_RT), ["joint_states", "joint_online"])
    (notice,) = (each for each in report.information if "rosrun plugins plugin" in each.what)
    assert "refuses joint_states, for the layer RT" in notice.what and notice.mark.line == LINE and not report.errors
    report = check_file(write(ON_XBOT), ["joint_states", "joint_online"])
    (notice,) = (each for each in report.information if "rosrun plugins plugin" in each.what)
    assert "refuses joint_states, joint_online," in notice.what and notice.mark.line == 12


@pytest.mark.slow
def test_a_check_names_a_shared_plugin_in_rt_and_requires_without_a_list(write):
    required = ("chain: all             #", "requires: [odometry]\n      chain: all             #")
    report = check_file(write(SHARED_IN_RT, required))
    (notice,) = (each for each in report.information if "rosrun plugins plugin" in each.what)
    assert "refuses shared, for the layer RT" in notice.what
    (notice,) = (each for each in report.information if "requires nothing" in each.what)
    assert notice.mark.path[-2:] == ("joint_states", "requires")


@pytest.mark.parametrize("shared", [False, True], ids=["alone", "shared"])
def test_requires_of_a_lone_plugin_is_logged(write, caplog, shared):
    caplog.set_level(logging.INFO, "solfer")
    file = write(("chain: all             #", "requires: [odometry]\n      chain: all             #"))
    require_ros(load(file, "joint_states"), str, shared=shared)
    explanation = [text for text in caplog.messages if text.endswith("has no effect: 'joint_states' runs alone")]
    assert [text.startswith(f"main.yaml:{LINE + 7}:") for text in explanation] == ([] if shared else [True])


def test_a_layer_refuses_plugins_for_ros_alone(write):
    file = write(("  xbot: *ends\n", ""))
    Path("layer.yaml").write_text(LAYER.replace("PLUGINS", "joint_states::joint_lower"))
    with pytest.raises(ConfigError, match="for ROS alone.*layer.yaml:1:27") as error:
        node("xbot", "layer.yaml")
    assert error.value.where == "main.yaml:12:15: mwoibn.middleware"
    assert f"`rosrun plugins plugin -p joint_states -n joint_lower -c {file}`" in error.value.expected


def test_nodes_name_each_other_for_wrong_files(write):
    file = write()
    Path("layer.yaml").write_text(LAYER.replace("PLUGINS", "joint_states"))
    with pytest.raises(ConfigError, match="file of an RT layer") as error:
        node("plugin", "plugin", "-p", "joint_states", "-c", "layer.yaml")
    assert "`rosrun solfer xbot layer.yaml`" in error.value.expected and error.value.where.startswith("layer.yaml:1:1")
    with pytest.raises(ConfigError, match="a main configuration, and not an RT layer") as error:
        node("xbot", file)
    assert "`rosrun plugins plugin -p ID -c main.yaml`" in error.value.expected


def test_shared_is_another_name_of_plugin(write, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["shared", "-n", "joint_states", "-c", str(CONFIG / "centauro.yaml")])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(REPOSITORY / "nodes/shared"), run_name="__main__")
    assert end.value.code == 2 and "'joint_states' lists no plugins" in capsys.readouterr().err


@pytest.mark.parametrize(("layer", "middleware", "rate"), [("NRT", "ROS", 200), ("RT", "XBOT", 500)])
def test_a_start_says_what_runs(caplog, layer, middleware, rate):
    caplog.set_level(logging.INFO, "solfer")
    file = str(CONFIG / "centauro.yaml")
    start(load(file, "joint_states", layer=layer, middleware=middleware))
    expected = f"layer {layer}, middleware {middleware}, {rate} Hz, Robot centauro (joint_space)"
    assert f"JointStates runs as joint_states of {file}: {expected}" in caplog.messages


def test_a_dry_run_knows_models_of_maps(write):
    """A model that a parameter holds is taken for the robot's, all of it; any other parameter is unknown."""
    configuration = load(write(("/robot_lower_body", "/model")), "joint_states")
    files = robot_files(configuration)
    middleware = DryMiddleware(configuration, files)
    assert middleware.parameter("/model") == Path(files.urdf).read_text()
    assert len(middleware.parameter("/robot_upper_body")) < len(middleware.parameter("/model"))
    with pytest.raises(UnknownName, match="unknown parameter '/modle'"):
        middleware.parameter("/modle")


def test_a_dry_run_knows_the_joints_of_controllers(write):
    """The shipped robot's position controller has all joints without a wheel's, and the other one has the rest."""
    configuration = load(write(), "joint_states")
    middleware = DryMiddleware(configuration, robot_files(configuration))
    positions, speeds = (middleware.controller_joints(f"{kind}_controller", 0.0) for kind in ("position", "velocity"))
    assert sorted(speeds) == [f"j_wheel_{leg}" for leg in (1, 2, 3, 4)]
    assert len(positions) == 38 and not set(positions) & set(speeds)


def test_a_start_says_its_unique_name(caplog, write):
    caplog.set_level(logging.INFO, "solfer")
    listed = "plugins: [odometry3::odometry, ground_forces, wheeled_motion::locomotion"
    file = write((listed, "plugins: [joint_states, joint_states"))
    start(load_shared(file, "full_control", default=Registry().configuration).configurations[1])
    assert any("runs as joint_states_2 (joint_states) of main.yaml" in message for message in caplog.messages)


def start(configuration):
    """Make the plugin of a configuration, connected to nothing."""
    middleware = DryMiddleware(configuration, robot_files(configuration))
    generate(configuration, middleware, Registry().find("joint_states")).close()
