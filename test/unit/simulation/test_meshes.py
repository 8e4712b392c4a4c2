"""Where the meshes of a robot are searched, and how missing ones are reported."""

import logging
import struct
from xml.etree import ElementTree

import pytest

from solfer.errors import SimulationError
from solfer.simulation.bullet.robot import READER
from solfer.simulation.loading.meshes import Meshes


def shape(tag, name):
    """Make a shape with a mesh."""
    return ElementTree.fromstring(f'<{tag}><geometry><mesh filename="{name}"/></geometry></{tag}>')


TRIANGLE = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.5, 0.25)


def binary(*triangles):
    """Write a binary STL: 80 bytes, a count, and for each triangle a normal, three corners and two bytes."""
    packed = (struct.pack("<12fH", 0.0, 0.0, 0.0, *sum(triangle, ()), 0) for triangle in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(packed)


def in_text(*triangles, vertex="vertex"):
    """Write an STL in text."""
    facets = ("\n".join(f"{vertex} {x} {y:e} {z}" for x, y, z in triangle) for triangle in triangles)
    return ("solid s\n" + "".join(f"facet\nouter loop\n{each}\nendloop\nendfacet\n" for each in facets)).encode()


@pytest.fixture
def robot(tmp_path):
    """Make a package with a URDF in a folder of its own, and one mesh."""
    (tmp_path / "my_robot/meshes").mkdir(parents=True)
    (tmp_path / "my_robot/urdf").mkdir()
    (tmp_path / "my_robot/meshes/leg.stl").write_bytes(binary(TRIANGLE))
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
    assert Meshes(str(robot / "urdf/robot.urdf"), robot, READER).resolve(collision, "link 'leg'")
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
        meshes = Meshes(str(robot / "urdf/robot.urdf"), robot, READER)
        meshes.resolve(shape("collision", name), "robot.urdf: link 'arm'")
    assert caught.value.where == "robot.urdf: link 'arm'"
    assert expected in caught.value.expected


def test_missing_visual_shapes_are_logged_once(robot, caplog):
    meshes = Meshes(str(robot / "urdf/robot.urdf"), robot, READER)
    assert not any(meshes.resolve(shape("visual", "arm.stl"), f"link '{link}'") for link in ("arm", "hand"))
    with caplog.at_level(logging.WARNING):
        meshes.warn()
    assert [record.getMessage() for record in caplog.records] == [
        "visual shapes without their meshes are left out: link 'arm': 'arm.stl' and 1 more"
    ]


@pytest.mark.parametrize(
    "content",
    [in_text(TRIANGLE, TRIANGLE), in_text(TRIANGLE, TRIANGLE, vertex="VERTEX"), binary(TRIANGLE, TRIANGLE) + b"more"],
)
def test_an_stl_that_pybullet_does_not_read_is_written_for_it(robot, tmp_path, content):
    (robot / "urdf/arm.STL").write_bytes(content)
    (tmp_path / "made").mkdir()
    meshes = Meshes(str(robot / "urdf/robot.urdf"), tmp_path / "made", READER)
    collision = shape("collision", "arm.STL")
    assert meshes.resolve(collision, "link 'arm'")
    written = tmp_path / "made/0.stl"
    assert collision.find("geometry/mesh").get("filename") == str(written)
    assert written.read_bytes() == binary(TRIANGLE, TRIANGLE)


@pytest.mark.parametrize(
    "name, content",
    [
        ("a.stl", b""),
        ("a.stl", b"solid s\nendsolid s\n"),
        ("a.stl", b"solid s\nvertex 1 2 x\n"),
        ("a.stl", binary(TRIANGLE)[:-1]),
        ("a.obj", b"# v\nvn 0 0 1\n"),
        ("a.dae", b"<COLLADA/>"),
        ("a.ply", b"ply\n"),
    ],
)
def test_a_mesh_in_which_nothing_is_found_is_named(robot, name, content):
    (robot / "urdf" / name).write_bytes(content)
    meshes = Meshes(str(robot / "urdf/robot.urdf"), robot, READER)
    assert not meshes.resolve(shape("visual", name), "link 'arm'")
    with pytest.raises(SimulationError, match=f"'{name}' of a collision shape has nothing that PyBullet reads"):
        meshes.resolve(shape("collision", name), "link 'arm'")


def test_other_meshes_stay_where_they_are(robot):
    for name, content in (("a.OBJ", b"v 0 0 1\n"), ("a.dae", b"<COLLADA><float_array id='a'>")):
        (robot / "urdf" / name).write_bytes(content)
        collision = shape("collision", name)
        assert Meshes(str(robot / "urdf/robot.urdf"), robot, READER).resolve(collision, "link 'arm'")
        assert collision.find("geometry/mesh").get("filename") == str(robot / "urdf" / name)
