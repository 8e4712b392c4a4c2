"""The paper's listings of configurations load as they are printed (file `listing_NN.yaml` is Listing NN)."""

import re
import shutil
import textwrap

import pytest
import yaml

from solfer.config import Configuration, load, load_shared
from solfer.plugins import Registry

HEAD = """
support_path: &support support/
mwoibn:
  middleware: ROS
  system: SM
  layers: {NRT: {file: rest.yaml}}
"""
LIBRARY = (6, 8, 10, 11)


SECONDARY = {
    1: "config: &config ../urdf/\nmwoibn:\n  ros:\n{4}",
    7: "mwoibn:\n{2}",
    13: "{0}",
    14: "{0}",
}
"""Text around a listing in the secondary file of Listing 12; the number is the listing's indentation."""


@pytest.fixture
def folder(repository, tmp_path):
    """Make a folder with the files that the listings use and do not print."""
    shutil.copy(repository / "test/data/config/listings_rest.yaml", tmp_path / "rest.yaml")
    (tmp_path / "support").mkdir()
    (tmp_path / "urdf/mwoibn/urdf").mkdir(parents=True)
    for part in ("upper", "lower"):
        (tmp_path / f"urdf/mwoibn/urdf/centauro_{part}_body.urdf").touch()
    return tmp_path


@pytest.fixture
def listings(repository, folder):
    """Return a loader of modules from listings; `changes` replace text in them."""

    def load_from(module: str, number: int, secondary: int = 13, **changes: str) -> Configuration:
        text = HEAD + "".join(listing(repository, each, 2) for each in (*LIBRARY, number))
        for key, value in changes.items():
            old = next(line for line in text.splitlines() if line.strip().startswith(f"{key}: "))
            text = text.replace(old, f"{old.partition(key)[0]}{key}: {value}")
        (folder / "main.yaml").write_text(text)
        frame, indent = re.fullmatch(r"(.*)\{(\d)\}", SECONDARY[secondary], re.DOTALL).groups()
        (folder / "support/upper_body.yaml").write_text(frame + listing(repository, secondary, int(indent)))
        return load(folder / "main.yaml", module)

    return load_from


def listing(repository, number: int, indent: int) -> str:
    """Return the text of a listing, indented."""
    text = (repository / f"test/data/config/listing_{number:02}.yaml").read_text()
    return textwrap.indent(text, " " * indent)


def test_listing_1_predefines_maps(listings, folder):
    mappings = listings("config_name", 12, secondary=1).mappings
    assert {name: record.loading for name, record in mappings.items()} == dict.fromkeys(
        ("RBDL_LOWER", "RBDL_UPPER"), "model"
    )
    assert mappings["RBDL_LOWER"].urdf.parameter == "/robot_lower_body"
    assert mappings["RBDL_UPPER"].urdf.location == folder / "urdf/mwoibn/urdf/centauro_upper_body.urdf"


def test_listing_6_is_a_pipe_in_joint_space(listings):
    (pipe,) = listings("joint_online", 9).feedbacks
    assert (pipe.name, pipe.space, pipe.function) == ("link_side_online", "JOINT", "state")
    assert (pipe.dofs.chain, pipe.dofs.type, pipe.dofs.mapping) == ("all", "actuated", "PYTHON")
    assert pipe.interface.position and pipe.interface.velocity and pipe.interface.effort


def test_listing_7_is_a_rigid_body_pipe(listings):
    (pipe,) = listings("config_name", 12, secondary=7, robot="floating").feedbacks
    assert (pipe.name, pipe.space, pipe.dofs.type, pipe.dofs.name) == ("floating_base", "OPERATIONAL", "body", "pelvis")
    assert (pipe.convention.orientation.type, pipe.convention.orientation.convention) == ("QUATERNION", "HAMILTONIAN")
    assert pipe.convention.position.type == "FULL"
    assert (pipe.interface.position, pipe.interface.velocity, pipe.interface.effort) == (True, False, False)


def test_listing_8_gives_the_part_of_ros(listings):
    configuration = listings("joint_online", 9, robot="offline", controller="[whole_body]")
    received, sent = configuration.feedbacks[0], configuration.controllers[0]
    assert (received.name, received.source, received.message, received.initialize) == (
        "whole_body", "desired_state", "custom_messages::CustomCmnd", False,
    )  # fmt: skip
    assert (sent.name, sent.type, sent.sink, sent.layer) == ("whole_body", "reference", "desired_state", None)


def test_listing_8_gives_the_part_of_xbot(listings):
    configuration = listings("config_name", 12, middleware="XBOT", controller="[whole_body]")
    (sent,) = configuration.controllers
    assert (configuration.middleware, sent.layer, sent.sink, sent.message) == ("XBOT", "NRT", "desired_state", None)
    assert configuration.feedbacks[0].dofs.mapping == "XBOT"


def test_listing_9_is_the_configuration_of_a_plugin(listings):
    module = listings("joint_online", 9).module
    assert (module.name, module.layer, module.robot, module.controller, module.mode) == (
        "joint_online", "NRT", "joint_space", "direct", "full",
    )  # fmt: skip
    assert (module.kinematics, module.dynamics, module.model_change) == (False, False, False)


@pytest.mark.parametrize(
    ("name", "actuators", "pipes"),
    [("online", True, ["link_side_online", "odometry", "reference"]), ("offline", False, ["whole_body", "reference"])],
)
def test_listing_10_defines_robots_by_their_feedbacks(listings, name, actuators, pipes):
    configuration = listings("joint_online", 9, robot=name)
    robot = configuration.robot
    assert (robot.configuration, robot.actuators.read, robot.contacts.read) == (name, actuators, True)
    assert [pipe.name for pipe in configuration.feedbacks] == pipes


def test_listing_11_defines_sets_of_pipes(listings):
    configuration = listings("joint_online", 9, robot="online")
    assert [pipe.name for pipe in configuration.feedbacks] == ["link_side_online", "odometry", "reference"]
    assert [pipe.name for pipe in configuration.controllers] == ["position_controller", "velocity_controller"]
    assert [pipe.type for pipe in configuration.controllers] == ["impedance", "velocity"]


def test_listing_12_is_overlaid_by_listing_13(listings):
    configuration = listings("config_name", 12)
    assert configuration.sources.urdf.parameter == "/robot_upper_body"
    assert configuration.sources.srdf.parameter == "/robot_srdf"
    assert [pipe.name for pipe in configuration.feedbacks] == ["link_side_online"]
    assert "support/upper_body.yaml:5:13" in configuration.where("ros", "source", "urdf")


def test_listing_13_keeps_the_folder(listings):
    urdf = listings("config_name", 12, middleware="XBOT").sources.urdf
    assert urdf.parameter is None
    assert urdf.location.parts[-4:] == ("urdf", "mwoibn", "urdf", "centauro_upper_body.urdf")


@pytest.mark.parametrize("middleware", ["ROS", "XBOT"])
def test_listing_14_receives_legs_and_commands_the_base(listings, middleware):
    configuration = listings("config_name", 12, secondary=14, middleware=middleware)
    position, velocity = configuration.controllers
    assert (position.dofs.chain, position.dofs.type, position.dofs.mapping) == ("base", "unactuated", "PYTHON")
    assert (velocity.dofs.chain, velocity.dofs.type) == ("wheels", "actuated")
    urdf = configuration.sources.urdf
    if middleware == "ROS":
        assert urdf.parameter == "/robot_lower_body"
    else:
        assert urdf.location.parts[-4:] == ("urdf", "mwoibn", "urdf", "centauro_lower_body.urdf")


LISTING_17 = [
    ("UpperBodyIK", "upper_body_ik"), ("odometry3", "odometry"), ("ground_forces", "ground_forces"),
    ("gravity_compensation", "gravity_compensation"), ("NwheelsZMPII", "wheeled_motion"),
]  # fmt: skip


@pytest.mark.parametrize(("layer", "rate"), [("NRT", 200.0), ("RT", 500.0)])
@pytest.mark.parametrize("mode", ["", "full", "idle"])
def test_listing_17_is_a_shared_plugin(repository, folder, layer, rate, mode):
    """Five plugins in order, those without a configuration with their own; layer and mode hold for all of them."""
    (folder / "RT.yaml").write_text((folder / "rest.yaml").read_text().replace("rate: 200", "rate: 500"))
    head = HEAD.replace("{NRT: {file: rest.yaml}}", "{NRT: {file: rest.yaml}, RT: {file: RT.yaml}}")
    text = head + "".join(listing(repository, each, 2) for each in LIBRARY)
    shared = yaml.safe_load(listing(repository, 17, 0))["shared"] | {"layer": layer} | ({"mode": mode} if mode else {})
    module = yaml.safe_load(listing(repository, 9, 0))["modules"]["joint_online"]
    modules = {"shared": shared} | {name: module for _, name in LISTING_17}
    (folder / "main.yaml").write_text(text + textwrap.indent(yaml.dump({"modules": modules}, sort_keys=False), "  "))
    loaded = load_shared(folder / "main.yaml", default=Registry().configuration)
    assert [(entry.plugin, entry.configuration.name) for entry in loaded.plugins] == LISTING_17
    assert {(each.module.layer, each.rate) for each in loaded.configurations} == {(layer, rate)}
    assert {each.module.mode for each in loaded.configurations} == {mode or "full"}
