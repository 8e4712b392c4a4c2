"""The shipped main configuration."""

import re

import pytest
import yaml

from solfer.config import load, load_shared, module_names
from solfer.plugins import Registry, check_file

MODULES = (
    "joint_states", "joint_online", "joint_lower", "joint_reference", "upper_body", "lower_body", "whole_body",
    "gravity_compensation", "desired_joints", "shared_compensation", "soft_compensation", "spring_compensation",
    "compliance_compensation", "odometry", "ground_forces", "gravity_forces",
    "inverse_kinematics", "desired_tasks", "inverse_dynamics", "squat", "squat_estimated", "squat_offline",
    "manipulation", "drawing", "upper_body_ik", "wheeled_motion",
    "driving", "stepping", "support_shaping", "hands", "locomotion", "full_compensation",
)  # fmt: skip
ROBOTS = {"default", "base_velocity", "force_test", "reference", "odometry", "joint_space", "simulated", "empty"}
"""The robot configurations of the original program."""


@pytest.fixture
def main(repository):
    return repository / "config/centauro.yaml"


def test_every_module_is_known(main):
    assert set(module_names(main)) == {*MODULES, "shared", "full_control"}


@pytest.mark.slow
def test_the_file_is_correct_and_missing_plugins_are_one_line(main):
    report = check_file(main)
    assert (report.errors, report.warnings) == ((), ())
    assert tuple(report.configurations) == MODULES
    assert not report.information  # every plugin is part of the package


def test_the_robot_configurations_of_the_original_are_there(main):
    robots = load(main, "joint_states").tree.get("robot")
    assert {name for name, _ in robots.items()} >= ROBOTS


def test_the_shared_plugin_is_listing_17(main, repository):
    printed = yaml.safe_load((repository / "test/data/config/listing_17.yaml").read_text())
    assert yaml.safe_load(main.read_text())["mwoibn"]["modules"]["shared"] == printed["shared"]
    registry = Registry()
    shared = load_shared(main, default=registry.configuration)
    assert all(entry.plugin in registry for entry in shared.plugins)


@pytest.mark.parametrize(("layer", "rate"), [("NRT", 200.0), ("RT", 500.0)])
@pytest.mark.parametrize("system", ["SM", "HW"])
def test_every_module_loads_on_every_layer_and_system(main, repository, tmp_path, layer, rate, system):
    """One tag changes layer or system: rates follow it, and only the hardware's feedback has limits."""
    text = main.read_text().replace("layer: NRT", f"layer: {layer}").replace("system: SM", f"system: {system}")
    folder = tmp_path / "config"
    folder.mkdir()
    for name in ("support", "robots"):
        (folder / name).symlink_to(repository / "config" / name)
    (folder / "centauro.yaml").write_text(text)
    loaded = {module: load(folder / "centauro.yaml", module) for module in MODULES}
    assert {
        module: (configuration.rate, configuration.system, configuration.module.layer)
        for module, configuration in loaded.items()
    } == dict.fromkeys(MODULES, (rate, system, layer))
    assert [
        module
        for module, configuration in loaded.items()
        for pipe in configuration.feedbacks
        if pipe.name == "link_side_online" and (pipe.limits is not None) != (system == "HW")
    ] == []


@pytest.mark.parametrize(
    ("module", "urdf"), [("joint_states", "/robot_description"), ("joint_lower", "/robot_lower_body")]
)
def test_the_pipes_of_the_joint_space_plugins(main, module, urdf):
    configuration = load(main, module)
    assert configuration.sources.urdf.parameter == urdf
    assert configuration.sources.srdf.parameter == "/robot_semantic_description"
    (received,) = configuration.feedbacks
    assert (received.source, received.message, received.initialize) == ("joint_states", "sensor_msgs/JointState", True)
    position, velocity = configuration.controllers
    assert (position.type, position.interface.position, position.interface.effort) == ("impedance", True, True)
    assert (velocity.type, velocity.interface.velocity, velocity.dofs.chain) == ("velocity", True, "wheels")
    assert {name: mapping.urdf.parameter for name, mapping in configuration.mappings.items()} == {
        "RBDL_LOWER": "/robot_lower_body",
        "RBDL_UPPER": "/robot_upper_body",
    }


def test_all_its_groups_are_in_the_robots_srdf(main, repository):
    groups = set(re.findall(r'<group name="(\w+)"', (repository / "config/robots/centauro/centauro.srdf").read_text()))
    named = set(re.findall(r"(?:chain|wheels|track|free): (\w+)", main.read_text()))
    assert named - {"all"} <= groups


def test_the_robot_is_the_one_of_its_files(main, repository):
    configuration = load(main, "joint_states")
    for source in (configuration.sources.actuators, configuration.sources.contacts):
        assert source.location.parent == repository / "config/robots/centauro"
        assert f"\n{configuration.robot.name}:\n" in source.location.read_text()
