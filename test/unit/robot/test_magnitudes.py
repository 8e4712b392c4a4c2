"""Numbers that are far beyond a robot, or far from a default: each is a warning that says what was expected."""

import re
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import pytest
import yaml

from solfer.components.odometry.tags import OdometryTags
from solfer.components.wheeled_motion.tags import WheeledMotionTags
from solfer.config import Problems, load, read
from solfer.robot.description.shipped import RobotFiles, robot_files
from solfer.robot.plausibility import check_plausibility
from solfer_tools.cli.main import main

DATA = Path(__file__).parents[2] / "data"
TABLE = yaml.safe_load((DATA / "magnitudes.yaml").read_text())
MISTAKES = [(group["tags"], each["written"], each["printed"]) for group in TABLE for each in group["mistakes"]]
URDFS = {"robi": DATA / "config/robots/robi/robi.urdf", "cart": DATA / "walk/cart.urdf"}


@pytest.fixture(scope="module", params=["centauro", *URDFS])
def robot(request, repository, tmp_path_factory):
    """Return the configuration of CENTAURO, or that of a package of `solfer new robot`, and where its URDF is."""
    if request.param == "centauro":
        return repository / "config/centauro.yaml", None
    package = tmp_path_factory.mktemp("packages") / request.param
    urdf = URDFS[request.param]
    assert main(["new", "robot", request.param, "--urdf", str(urdf), "--package", str(package)]) == 0
    return package / f"config/{request.param}.yaml", RobotFiles(urdf)


def warned(configuration, files, tags=None):
    """Return the warnings about a configuration and tags, without their files and lines."""
    problems = Problems()
    check_plausibility(files or robot_files(configuration), configuration, tags, problems)
    return [re.sub(r"^\S+:\d+:\d+: ", "", str(each)) for each in problems.notices if ".urdf:" not in str(each)]


@pytest.mark.slow
def test_numbers_that_are_hardly_meant_are_warnings(robot, tmp_path):
    file, files = robot
    configuration = load(file, "joint_states")
    assert warned(configuration, files) == [] and len(MISTAKES) > 60
    for kind, written, printed in MISTAKES:
        module, _, name = kind.partition(":")
        (tmp_path / "tags.yaml").write_text(written)
        tags = read(tmp_path / "tags.yaml", attrgetter(name)(import_module(module)))
        (found,) = warned(configuration, files, tags)
        assert re.fullmatch(re.escape(printed).replace(r"\*", r"[\d.]+"), found), (found, printed)


def test_tags_of_a_plugin_are_compared_with_their_defaults(tmp_path, capsys):
    assert main(["new", "robot", "robi", "--urdf", str(URDFS["robi"]), "--package", str(tmp_path / "robi")]) == 0
    file = tmp_path / "robi/config/robi.yaml"
    file.write_text(file.read_text().replace("mode: full ", "blend: 50.0\n      mode: full ", 1))
    capsys.readouterr()
    assert main(["check", str(file)]) == 0
    assert "joint_states.blend: 50 s is 100 times the default, 0.5 s; 50 ms are 0.05 s" in capsys.readouterr().err


@pytest.mark.parametrize(
    "tags, printed",
    [
        ("{wheel_radius: 0.0068}", ["wheel_radius: 0.0068 m, and the robot's wheels have a radius of 0.078 m"]),
        ("{wheel_radius: 0.03}", []),
        (
            "{wheel_radius: 0.78}",
            [
                "wheel_radius: 0.78 m, and the robot's wheels have a radius of 0.078 m; "
                "0.78 mm are 0.00078 m, 0.78 cm are 0.0078 m"
            ],
        ),
    ],
)
def test_a_radius_is_compared_with_the_wheels(repository, tmp_path, tags, printed):
    (tmp_path / "tags.yaml").write_text(tags)
    record = read(tmp_path / "tags.yaml", OdometryTags)
    assert warned(load(repository / "config/centauro.yaml", "joint_states"), None, record) == printed


@pytest.mark.parametrize(
    "tag, printed",
    [
        ("minor_axis: 0.0068", ["minor_axis: 0.0068 m, and the robot's wheels have a tube of 0.068 m"]),
        ("minor_axis: 0.03", []),
        (
            "major_axis: 0.1",
            [
                "major_axis: 0.1 m, and the robot's wheels have a ring of 0.01 m; "
                "0.1 mm are 0.0001 m, 0.1 cm are 0.001 m"
            ],
        ),
        ("major_axis: 0.001", ["major_axis: 0.001 m, and the robot's wheels have a ring of 0.01 m"]),
    ],
)
def test_parts_of_wheels_are_compared_with_theirs(repository, tmp_path, tag, printed):
    (tmp_path / "tags.yaml").write_text(f"{{track: all, IK: [CONSTRAINTS, BASE, STEERING], {tag}}}")
    record = read(tmp_path / "tags.yaml", WheeledMotionTags)
    assert warned(load(repository / "config/centauro.yaml", "wheeled_motion"), None, record) == printed
