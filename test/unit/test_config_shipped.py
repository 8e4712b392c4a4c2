"""The shipped main configuration."""

import re

import pytest

from solfer.config import load, module_names

MODULES = ("joint_states", "joint_lower", "upper_body", "lower_body", "whole_body")


@pytest.fixture
def main(repository):
    return repository / "config/centauro.yaml"


def test_every_module_is_known(main):
    assert module_names(main) == MODULES


@pytest.mark.parametrize("module", MODULES)
@pytest.mark.parametrize(("layer", "rate"), [("NRT", 200.0), ("RT", 500.0)])
@pytest.mark.parametrize("system", ["SM", "HW"])
def test_every_module_loads_on_every_layer_and_system(main, repository, tmp_path, module, layer, rate, system):
    text = main.read_text().replace("layer: NRT", f"layer: {layer}").replace("system: SM", f"system: {system}")
    folder = tmp_path / "config"
    folder.mkdir()
    for name in ("support", "robots"):
        (folder / name).symlink_to(repository / "config" / name)
    (folder / "centauro.yaml").write_text(text)
    configuration = load(folder / "centauro.yaml", module)
    assert (configuration.rate, configuration.system, configuration.module.layer) == (rate, system, layer)
    assert (configuration.feedbacks[0].limits is not None) == (system == "HW")


@pytest.mark.parametrize(
    ("module", "urdf"), [("joint_states", "/robot_description"), ("joint_lower", "/robot_lower_body")]
)
def test_the_pipes_of_the_joint_space_plugins(main, module, urdf):
    configuration = load(main, module)
    assert configuration.sources.urdf.parameter == urdf
    assert configuration.sources.srdf.parameter == "/robot_semantic_description"
    (heard,) = configuration.feedbacks
    assert (heard.source, heard.message, heard.initialize) == ("joint_states", "sensor_msgs/JointState", True)
    position, velocity = configuration.controllers
    assert (position.type, position.interface.position, position.interface.effort) == ("impedance", True, True)
    assert (velocity.type, velocity.interface.velocity, velocity.dofs.chain) == ("velocity", True, "wheels")
    assert {name: mapping.urdf.parameter for name, mapping in configuration.mappings.items()} == {
        "RBDL_LOWER": "/robot_lower_body",
        "RBDL_UPPER": "/robot_upper_body",
    }


def test_all_its_groups_are_in_the_robots_srdf(main, repository):
    groups = set(re.findall(r'<group name="(\w+)"', (repository / "config/robots/centauro/centauro.srdf").read_text()))
    named = set(re.findall(r"(?:chain|wheels): (\w+)", main.read_text()))
    assert named - {"all"} <= groups


def test_the_robot_is_the_one_of_its_files(main, repository):
    configuration = load(main, "joint_states")
    for source in (configuration.sources.actuators, configuration.sources.contacts):
        assert source.location.parent == repository / "config/robots/centauro"
        assert f"\n{configuration.robot.name}:\n" in source.location.read_text()
