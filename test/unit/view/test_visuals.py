"""What the links of a robot look like: colours, and meshes in units of their own."""

import logging

import numpy as np
import pytest
from support.unit.colladas import COLLADA

from solfer.model import Description

pytest.importorskip("trimesh")
from solfer_tools.view.visuals import DEFAULT_GREY, visuals_of  # noqa: E402 it imports trimesh


def robot(color, geometry='<box size="1 1 1"/>'):
    """Describe a link of one colour."""
    return (
        f'<robot name="r"><material name="paint">\n<color {color}/></material><link name="a"><visual>'
        f'<geometry>{geometry}</geometry><material name="paint"/></visual></link></robot>'
    )


@pytest.mark.parametrize(
    ("color", "seen"),
    [
        ('rgba="0.1 0.2 0.3 0.4"', (0.1, 0.2, 0.3, 0.4)),
        ("", DEFAULT_GREY),
        ('rgba="0.1 0.2 0.3"', (0.1, 0.2, 0.3, 1.0)),
        ('rgba="255 128 0 255"', (1.0, 1.0, 0.0, 1.0)),
        ('rgba="0.1, 0.2, 0.3, 1"', DEFAULT_GREY),
        ('rgba="0.1 nan 0.3 1"', DEFAULT_GREY),
        ('rgba=""', DEFAULT_GREY),
        ('rgba="1 1 1 1 1"', DEFAULT_GREY),
    ],
)
def test_a_colour_that_is_none_is_a_warning_with_its_place(caplog, color, seen):
    with caplog.at_level(logging.WARNING):
        (visual,) = visuals_of(Description.from_text(robot(color), "r.urdf"))["a"]
    assert visual.color == seen
    is_right = not color or seen == (0.1, 0.2, 0.3, 0.4)
    assert [record.getMessage() for record in caplog.records] == (
        [] if is_right else [f"a colour has four numbers from 0 to 1: r.urdf:2:1: {color}: link 'a'"]
    )


@pytest.mark.parametrize("unit", ["", "0", "x"])
def test_a_mesh_without_a_unit_that_can_be_read_is_left_out(tmp_path, caplog, unit):
    (tmp_path / "a.dae").write_text(COLLADA.format(unit=unit))
    text = robot('rgba="1 1 1 1"', '<mesh filename="a.dae"/>')
    with caplog.at_level(logging.WARNING):
        assert not visuals_of(Description.from_text(text, str(tmp_path / "r.urdf")))["a"]
    assert "shapes that cannot be read are left out: a.dae" in caplog.text


def test_units_of_a_mesh_and_its_scale_count(tmp_path):
    (tmp_path / "a.dae").write_text(COLLADA.format(unit="0.1"))
    text = robot('rgba="1 1 1 1"', '<mesh filename="a.dae" scale="1 1 2"/>')
    (visual,) = visuals_of(Description.from_text(text, str(tmp_path / "r.urdf")))["a"]
    np.testing.assert_allclose(np.ptp(visual.mesh.bounds, axis=0), (0.1, 0.2, 0.6), atol=1e-6)


@pytest.mark.parametrize("size", ["a b c", "1 2", ""])
def test_a_shape_that_cannot_be_read_is_left_out(caplog, size):
    """Also one whose numbers the reader of the robot has not refused."""
    text = robot('rgba="1 1 1 1"', '<box size="1 1 1"/><cone/><sphere radius="2"/>')
    description = Description.from_text(text, "r.urdf")
    description.links["a"].visuals[0].find("geometry/box").set("size", size)
    with caplog.at_level(logging.WARNING):
        (visual,) = visuals_of(description)["a"]
    np.testing.assert_allclose(np.ptp(visual.mesh.bounds, axis=0), 4.0, atol=0.1)
    assert caplog.messages == ["shapes that cannot be read are left out: box and 1 more"]
