"""A running plugin returns its effective configuration."""

import pytest
import yaml
from support.integration.world import CONFIG

from solfer.config import load


@pytest.mark.parametrize("origins", [True, False])
def test_a_plugin_returns_its_configuration(world, tmp_path, origins):
    world.plugin("joint_lower")
    reply = world.ask("joint_lower/get_config", origins=origins)
    assert reply.success
    published = yaml.safe_load(reply.yaml)["mwoibn"]
    assert published["ros"]["source"]["urdf"] == "/robot_lower_body"  # of the secondary file
    assert published["robot"]["rate"] == 200
    assert list(published["modules"]) == ["joint_lower"]
    assert f"# {CONFIG}/support/lower_body.yaml:5:13" in reply.yaml or not origins
    assert ("#" in reply.yaml) == origins
    (tmp_path / "reply.yaml").write_text(reply.yaml)
    again, first = load(tmp_path / "reply.yaml", "joint_lower"), load(CONFIG / "centauro.yaml", "joint_lower")
    assert (again.feedbacks, again.controllers, again.rate) == (first.feedbacks, first.controllers, first.rate)
    assert again.sources.actuators.location == first.sources.actuators.location
