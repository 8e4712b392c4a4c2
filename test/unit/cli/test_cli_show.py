"""`solfer show`: the effective configuration as YAML, with and without origins."""

import re
from pathlib import Path

import pytest
import yaml

from solfer.config import load
from solfer_tools.cli.main import main

CONFIG = Path(__file__).parents[3] / "config"
CENTAURO = CONFIG / "centauro.yaml"


def shown(capsys, *arguments):
    assert main(["show", str(CENTAURO), *arguments]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("name", ["joint_states", "joint_lower", "whole_body"])
def test_the_text_loads_back_to_the_same_configuration(name, tmp_path, capsys):
    file = tmp_path / "shown.yaml"
    file.write_text(shown(capsys, "-n", name))
    again, first = load(file, name), load(CENTAURO, name)
    assert (again.feedbacks, again.controllers, again.rate) == (first.feedbacks, first.controllers, first.rate)
    assert again.sources.urdf == first.sources.urdf
    assert again.module.model_copy(update={"secondary_file": None}) == first.module.model_copy(
        update={"secondary_file": None}
    )


def test_every_value_has_its_origin(capsys):
    text = shown(capsys, "-n", "joint_lower")
    rate = next(line for line in text.splitlines() if " rate:" in line)
    assert re.search(r"rate: 200 +# .*support/NRT\.yaml:4:11$", rate)
    urdf = next(line for line in text.splitlines() if "/robot_lower_body" in line and "urdf" in line)
    assert "support/lower_body.yaml:5:" in urdf
    lines = [line for line in text.splitlines() if not line.startswith("# declares")]
    values = [line for line in lines if not line.split("  #")[0].rstrip().endswith(":")]
    assert values and all(re.search(r"# \S+:\d+:\d+$", line) for line in values)


def test_the_values_are_the_same_without_origins(capsys):
    plain = shown(capsys, "-n", "joint_states", "--no-origin")
    assert "#" not in plain
    assert yaml.safe_load(plain) == yaml.safe_load(shown(capsys, "-n", "joint_states", "--origin"))


def test_the_plan_is_that_of_the_page(repository, capsys):
    page = (repository / "docs/explanation/how_solfer_works.md").read_text()
    assert f"```text\n{shown(capsys, '-n', 'wheeled_motion', '--plan')}```" in page


@pytest.mark.parametrize("name", ["odometry", "ground_forces", "manipulation"])
def test_a_plan_has_every_pipe(name, capsys):
    """Also those of bodies, Points and contacts, and the topics that a component declares."""
    configuration = load(CENTAURO, name)
    rows = [line.split() for line in shown(capsys, "-n", name, "--plan").splitlines()[1:]]
    assert {row[1] for row in rows if row[0] == "read"} >= {each.name for each in configuration.feedbacks}
    assert [row[1] for row in rows if row[0] == "write"] == [each.name for each in configuration.controllers]
    assert any(row[0] == "publish" for row in rows)


def test_the_system_may_be_another_one(capsys):
    text = shown(capsys, "-n", "joint_states", "--system", "HW", "--no-origin")
    assert yaml.safe_load(text)["mwoibn"]["feedback"]["link_side_online"]["calibration"] == "encoders"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([str(CENTAURO), "-n", "joint_stats"], "did you mean: joint_states"),
        (["none.yaml", "-n", "joint_states"], "there is no file 'none.yaml'"),
    ],
)
def test_a_mistake_is_one_block(arguments, message, capsys):
    assert main(["show", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and message in err


def test_what_its_component_declares_is_listed(capsys):
    lines = shown(capsys, "-n", "inverse_kinematics").splitlines()
    listed = {tuple(line.split()[2:]) for line in lines if line.startswith("# declares")}
    assert ("service", "inverse_kinematics/reference", "solfer/SetReference") in listed
    assert ("topic", "in", "inverse_kinematics/left/reference", "geometry_msgs/PointStamped") in listed
    assert ("action", "inverse_kinematics/reach", "solfer/Reach") in listed
