"""The paper's listings about joint-space pipes load as they are printed (file `listing_NN.yaml` is Listing NN)."""

import shutil

import pytest

from solfer.config import Configuration, load

HEAD = """
support_path: &support support/
mwoibn:
  middleware: ROS
  system: SM
  layers: {NRT: {file: rest.yaml}}
"""
LIBRARY = (6, 8, 10, 11)


@pytest.fixture
def listings(repository, tmp_path):
    """Loads a module of a main configuration that is put together from listings; `changes` replace text in it."""

    def load_from(module: str, number: int, **changes: str) -> Configuration:
        data, text = repository / "test/data/config", HEAD
        for listing in (*LIBRARY, number):
            lines = (data / f"listing_{listing:02}.yaml").read_text().splitlines()
            text += "".join(f"  {line}\n" for line in lines)
        for key, value in changes.items():
            old = next(line for line in text.splitlines() if line.strip().startswith(f"{key}: "))
            text = text.replace(old, f"{old.partition(key)[0]}{key}: {value}")
        (tmp_path / "main.yaml").write_text(text)
        shutil.copy(data / "listings_rest.yaml", tmp_path / "rest.yaml")
        (tmp_path / "support").mkdir()
        shutil.copy(data / "listing_13.yaml", tmp_path / "support/upper_body.yaml")
        (tmp_path / "urdf/mwoibn/urdf").mkdir(parents=True)
        (tmp_path / "urdf/mwoibn/urdf/centauro_upper_body.urdf").touch()
        return load(tmp_path / "main.yaml", module)

    return load_from


def test_listing_6_is_a_pipe_in_joint_space(listings):
    (pipe,) = listings("joint_online", 9).feedbacks
    assert (pipe.name, pipe.space, pipe.function) == ("link_side_online", "JOINT", "state")
    assert (pipe.dofs.chain, pipe.dofs.type, pipe.dofs.mapping) == ("all", "actuated", "PYTHON")
    assert pipe.interface.position and pipe.interface.velocity and pipe.interface.effort


def test_listing_8_gives_the_part_of_ros(listings):
    configuration = listings("joint_online", 9, robot="offline", controller="[whole_body]")
    heard, sent = configuration.feedbacks[0], configuration.controllers[0]
    assert (heard.name, heard.source, heard.message, heard.initialize) == (
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
def test_listing_10_defines_robots_that_hear_the_sensors_or_other_plugins(listings, name, actuators, pipes):
    configuration = listings("joint_online", 9, robot=name)
    robot = configuration.robot
    assert (robot.configuration, robot.actuators.read, robot.contacts.read) == (name, actuators, True)
    assert [pipe.name for pipe in configuration.feedbacks] == pipes


def test_listing_11_defines_sets_of_pipes(listings):
    configuration = listings("joint_online", 9, robot="online")
    assert [pipe.name for pipe in configuration.feedbacks] == ["link_side_online", "odometry", "reference"]
    assert [pipe.name for pipe in configuration.controllers] == ["position_controller", "velocity_controller"]
    assert [pipe.type for pipe in configuration.controllers] == ["impedance", "velocity"]


def test_listings_12_and_13_change_the_model_and_drop_the_state_estimation(listings):
    configuration = listings("config_name", 12)
    assert configuration.sources.urdf.parameter == "/robot_upper_body"
    assert configuration.sources.srdf.parameter == "/robot_srdf"
    assert [pipe.name for pipe in configuration.feedbacks] == ["link_side_online"]
    assert "support/upper_body.yaml:5:13" in configuration.where("ros", "source", "urdf")


def test_listing_13_names_only_the_file_and_keeps_the_folder(listings):
    urdf = listings("config_name", 12, middleware="XBOT").sources.urdf
    assert urdf.parameter is None
    assert urdf.location.parts[-4:] == ("urdf", "mwoibn", "urdf", "centauro_upper_body.urdf")
