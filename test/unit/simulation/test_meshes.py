"""Where the meshes of a robot are searched, and how missing ones are reported."""

import logging
from xml.etree import ElementTree

import pytest

from solfer.errors import SimulationError
from solfer.simulation.robot_body.meshes import Meshes


def shape(tag, name):
    """Make a shape with a mesh."""
    return ElementTree.fromstring(f'<{tag}><geometry><mesh filename="{name}"/></geometry></{tag}>')


@pytest.fixture
def robot(tmp_path):
    """Make a package with a URDF in a folder of its own, and one mesh."""
    (tmp_path / "my_robot/meshes").mkdir(parents=True)
    (tmp_path / "my_robot/urdf").mkdir()
    (tmp_path / "my_robot/meshes/leg.stl").write_text("solid leg\nendsolid leg\n")
    return tmp_path / "my_robot"


@pytest.mark.parametrize(
    "name",
    [
        "package://my_robot/meshes/leg.stl",
        "package:///my_robot/meshes/leg.stl",
        "../meshes/leg.stl",
        "{robot}/meshes/leg.stl",
        "file://{robot}/meshes/leg.stl",
    ],
)
def test_a_mesh_is_found_from_the_urdf(robot, name):
    collision = shape("collision", name.format(robot=robot))
    assert Meshes(str(robot / "urdf/robot.urdf")).resolve(collision, "link 'leg'")
    found = collision.find("geometry/mesh").get("filename")
    assert (robot / "urdf" / found).samefile(robot / "meshes/leg.stl")


@pytest.mark.parametrize(
    "name, expected",
    [
        ("package://my_robot/meshes/arm.stl", "folder 'my_robot'"),
        ("arm.stl", "urdf/arm.stl"),
    ],
)
def test_a_missing_collision_mesh_names_the_link(robot, name, expected):
    with pytest.raises(SimulationError, match="is not there") as caught:
        Meshes(str(robot / "urdf/robot.urdf")).resolve(shape("collision", name), "robot.urdf: link 'arm'")
    assert caught.value.where == "robot.urdf: link 'arm'"
    assert expected in caught.value.expected


def test_missing_visual_shapes_are_logged_once(robot, caplog):
    meshes = Meshes(str(robot / "urdf/robot.urdf"))
    assert not any(meshes.resolve(shape("visual", "arm.stl"), f"link '{link}'") for link in ("arm", "hand"))
    with caplog.at_level(logging.WARNING):
        meshes.warn()
    assert [record.getMessage() for record in caplog.records] == [
        "visual shapes without their meshes are left out: link 'arm': 'arm.stl' and 1 more"
    ]
