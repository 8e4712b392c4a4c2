"""Listings 8 and 14 of the paper, and the original program's configuration of XBOT, run as they are printed."""

import shutil
import textwrap

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from support.integration.bridged import BridgedWorld
from support.integration.world import CONFIG, ROBOT, World
from support.integration.xbot_world import XbotWorld
from support.realtime.executor_plugins import Layer

from solfer.config import load
from solfer.errors import PipeError
from solfer.middleware.memory import MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import PluginState, check_file

LISTINGS = (6, 8)
MODULE = {"class": "solfer.components:Component", "layer": "NRT", "mode": "full"}
MODULE |= dict.fromkeys(("kinematics", "dynamics", "model_change"), False)
READS = {"actuators": {"read": False}, "contacts": {"read": False}}
PYTHON = {"PYTHON": {"loading": "topic", "source": "joint_states", "message": "sensor_msgs::JointState"}}


PART = "mwoibn/urdf/centauro_{}_body.urdf"
SIDES = ("lower", "upper")


def models(urdf):
    """Make the maps of the robot's parts; `urdf` makes the tag of one side."""
    return {f"RBDL_{side.upper()}": {"loading": "model", "urdf": urdf(side)} for side in SIDES}


def write_parts(folder):
    """Write the URDFs of the robot's parts, as the listings name them."""
    (folder / "mwoibn/urdf").mkdir(parents=True)
    whole = Description.from_file(ROBOT / "centauro.urdf")
    for side in SIDES:
        (folder / PART.format(side)).write_text(cut(whole, "torso_2", side))


@pytest.fixture
def listed(repository, tmp_path):
    """Return a function that writes a main configuration around the listings; its modules are `name: (in, out)`."""
    data = repository / "test/data/config"

    def listing(number, indent):
        return textwrap.indent((data / f"listing_{number:02}.yaml").read_text(), " " * indent)

    def write(secondary=None, middleware="ROS", **modules):
        rest = yaml.safe_load((data / "listings_rest.yaml").read_text())
        section = rest["mwoibn"]
        section["ros"]["source"] = {"urdf": "/robot_description", "srdf": "/robot_semantic_description"}
        section["xbot"]["source"] = {"urdf": {"file": "whole.urdf"}, "srdf": {"file": "whole.srdf"}}
        section["ros"]["mapping"] = PYTHON | models("/robot_{}_body".format)
        section["xbot"]["mapping"] = PYTHON | models(lambda side: {"file": PART.format(side)})
        section["robot"] |= {name: {"feedback": {"list": pipes[0]}} | READS for name, pipes in modules.items()}
        main = {name: MODULE | {"robot": name, "controller": pipes[1]} for name, pipes in modules.items()}
        if secondary is not None:
            (tmp_path / "secondary.yaml").write_text(listing(secondary, 0))
            main = {name: module | {"secondary_file": {"file": "secondary.yaml"}} for name, module in main.items()}
        (tmp_path / "rest.yaml").write_text(yaml.safe_dump(rest))
        for end in ("urdf", "srdf"):
            shutil.copy(ROBOT / f"centauro.{end}", tmp_path / f"whole.{end}")
        write_parts(tmp_path)
        text = f"mwoibn:\n  middleware: {middleware}\n  system: SM\n  layers: {{NRT: {{file: rest.yaml}}}}\n"
        text += "".join(listing(number, 2) for number in LISTINGS)
        (tmp_path / "main.yaml").write_text(text + textwrap.indent(yaml.safe_dump({"modules": main}), "  "))
        return tmp_path / "main.yaml"

    return write


def send(plugin, start):
    """Write a posture into the desired State."""
    plugin.robot.command.position[:] = np.linspace(start, start + 1.0, plugin.robot.size)
    return plugin.robot.command.position


def test_listing_8_crosses_outwards(listed, tmp_path):
    """The layer publishes as the XBOT half says, a plugin outside receives as the ROS half says."""
    file = listed(inside=(["link_side_online"], ["whole_body"]), outside=(["whole_body"], []))
    world = BridgedWorld(tmp_path, [load(file, "inside", middleware="XBOT")])
    inside, outside = world.plugin("inside", file), world.outside("outside", file)
    for start in (0.0, 0.3):
        sent = send(inside, start)
        world.run(0.2)
        assert_allclose(outside.robot.state.position, sent)
    assert world.bridge.crossings["desired_state"].refused == 0
    measured = [world.simulation.q[inside.robot.dof(inside.robot.dofs[dof])] for dof in inside.robot.actuated]
    assert_allclose(inside.robot.state.position[inside.robot.actuated], measured, atol=1e-3)
    world.close()


def test_listing_8_crosses_inwards(listed, tmp_path):
    file = listed(inside=(["link_side_online", "whole_body"], []), outside=([], ["whole_body"]))
    world = BridgedWorld(tmp_path, [load(file, "inside", middleware="XBOT")])
    inside, outside = world.plugin("inside", file), world.outside("outside", file)
    for start in (0.0, 0.3):
        sent = send(outside, start)
        world.run(0.2)
        assert_allclose(inside.robot.state.position[:6], sent[:6])
    assert world.bridge.crossings["desired_state"].refused == 0
    world.close()


@pytest.mark.parametrize("kind", [World, XbotWorld])
def test_listing_14_publishes_the_base(listed, tmp_path, kind):
    file = listed(14, legs=(["link_side_online"], ["position_controller"]))
    world = kind(tmp_path) if kind is XbotWorld else kind()
    topic = ("position_controller/command", "solfer/JointCommand")
    node = world.node("ear") if kind is XbotWorld else MemoryMiddleware(world.bus, "ear")
    reader = node.reader(*topic)
    plugin = world.plugin("legs", file)
    plugin.robot.command.position[:6] = base = np.linspace(0.1, 0.6, 6)
    world.run(0.2)
    assert plugin.life is PluginState.RUNNING and not plugin.outputs.commanding
    reader.read()
    assert reader.message.names == ("x", "y", "z", "rx", "ry", "rz")
    assert_allclose(reader.message.position, base)
    assert world.simulation.lower_level.refused == 0  # a base has no drive: nothing for the lower level
    world.close()


def test_listing_14_needs_a_floating_base(listed, world):
    file = listed(14, legs=(["link_side_online"], ["position_controller"]))
    text = (file.parent / "secondary.yaml").read_text()
    (file.parent / "secondary.yaml").write_text(text.replace("/robot_lower_body", "/robot_upper_body"))
    with pytest.raises(PipeError, match="carries no DoF: none of chain 'base', type 'unactuated'") as caught:
        world.plugin("legs", file)
    assert caught.value.expected == "a model with a floating base" and "secondary.yaml:6:" in caught.value.where


@pytest.fixture
def original(repository, tmp_path):
    """Write the original's main configuration with `middleware: XBOT`; return it and the folders of its files."""
    folder = repository / "test/data/original"
    text = (folder / "mwoibn_2_5.yaml").read_text()
    file = tmp_path / "mwoibn_2_5.yaml"
    file.write_text(text.replace("middleware: ROS", "middleware: XBOT"))
    write_parts(tmp_path / "files")
    shutil.copy(ROBOT / "centauro.urdf", tmp_path / "files/mwoibn/urdf")
    return file, (tmp_path / "files", folder, CONFIG)


def test_the_original_s_xbot_half_checks(original):
    file, folders = original
    assert check_file(file, search_paths=folders).errors == ()


def test_the_original_s_xbot_half_runs(original, tmp_path):
    """Its joint_states moves the robot in the RT layer: pipes in the order of XBOT, and the IMU of its `odometry`."""
    file, folders = original
    module = "joint_states:\n                        layer: NRT\n                        robot: "
    text = file.read_text()
    assert f"{module}joint_space" in text
    file.write_text(text.replace(f"{module}joint_space", f"{module}odometry"))
    world = XbotWorld(tmp_path)
    layer = Layer(world, tmp_path / "layer", [("joint_states", file)], search_paths=folders, middleware="XBOT")
    layer["joint_states"].start()
    world.run(1.0)
    robot = layer["joint_states"].plugin.robot
    assert repr(robot.maps["XBOT"]) == "BidirectionalMap(XBOT: 42 of 48 DoFs, 42 outside)"
    left = ("knee_pitch_1", "knee_pitch_3")
    bent = [1.3 * robot.state.position[robot.dof(knee)] for knee in left]
    reply = world.ask(joints=("torso_yaw", *left), positions=(0.2, *bent), speed=2.0)
    assert reply.success
    world.run(reply.duration + 0.4)
    assert layer["joint_states"].state is PluginState.RUNNING
    assert world.simulation.q[robot.dof("torso_yaw")] == pytest.approx(0.2, abs=0.02)
    tilt = world.simulation.q[3:5]
    assert np.abs(tilt).max() > 0.01
    assert_allclose(robot.state.position[3:5], tilt, atol=2e-3)
    world.close()
