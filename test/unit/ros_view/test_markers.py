"""Markers of a scene: what there is, where, and that cones of friction hold the tips of forces that keep their grip."""

from collections import Counter

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer_tools.ros_view.markers import FORCE_SCALE, markers_of, world_markers
from solfer_tools.scene import ContactForce, ScenePose, SceneState, ShownReference, WorldSurface

FRICTION = 0.5
SQUARE = np.array(((0.0, 0.0, 0.1), (1.0, 0.0, 0.1), (1.0, 1.0, 0.1), (0.0, 1.0, 0.1)))


def scene(**changes):
    pose = ScenePose(np.array((0.5, 0.4, 0.9)), np.eye(3))
    parts = {
        "frame": "odom",
        "measured": {},
        "desired": {},
        "center": np.array((0.5, 0.5, 0.8)),
        "projection": np.array((0.5, 0.5, 0.1)),
        "polygon": SQUARE,
        "inner": np.zeros((0, 3)),
        "forces": (),
        "friction": FRICTION,
        "references": (ShownReference("hands", "left", "pose", "pelvis", pose, pose, pose),),
        "path": np.array(((0.0, 0.0, 0.7), (0.1, 0.0, 0.7))),
        "estimated_path": np.zeros((0, 3)),
    }
    return SceneState(**(parts | changes))


def named(markers, name):
    return [marker for marker in markers if marker.ns == name]


def xyz(point):
    return np.array((point.x, point.y, point.z))


def test_what_is_known_has_markers_that_disappear_by_themselves():
    markers = list(markers_of(scene()))
    assert Counter(each.ns for each in markers) == {
        "center": 3, "polygon": 1, "references": 1, "desired": 1, "names": 1, "path": 1,
    }  # fmt: skip
    assert {each.header.frame_id for each in markers} == {"odom"}
    assert all(0.0 < each.lifetime.to_sec() < 1.0 for each in markers)
    (polygon,), (path,) = named(markers, "polygon"), named(markers, "path")
    assert_allclose([xyz(each) for each in polygon.points], [*SQUARE, SQUARE[0]])
    assert_allclose([each.z for each in path.points], 0.1)  # on the ground
    assert named(markers, "names")[0].text == "hands/left"


@pytest.mark.parametrize(("sideways", "holds"), [(0.9, True), (1.1, False)])
def test_a_cone_holds_the_tip_of_what_friction_holds(sideways, holds):
    """The rim of the cone is as high as the tip of the arrow, which lies within it or not."""
    force = np.array((sideways * FRICTION * 300.0, 0.0, 300.0))
    markers = list(markers_of(scene(forces=(ContactForce("leg", np.ones(3), force, True),))))
    (arrow,), (cone,) = named(markers, "forces"), named(markers, "cones")
    begin, tip = map(xyz, arrow.points)
    assert_allclose(tip - begin, FORCE_SCALE * force)
    corners = np.array([xyz(point) for point in cone.points]).reshape(-1, 3, 3)
    assert_allclose(corners[:, 0] - begin, 0.0, atol=1e-12)
    rim = corners[:, 1:].reshape(-1, 3)
    assert_allclose(rim[:, 2], tip[2])
    radius = np.linalg.norm(rim[:, :2] - begin[:2], axis=1).max()
    assert (np.linalg.norm((tip - begin)[:2]) < radius) == holds


def test_a_lifted_contact_has_no_arrow():
    lifted = ContactForce("leg", np.ones(3), np.array((0.0, 0.0, 1.0)), False)
    assert not {"forces", "cones"} & {each.ns for each in markers_of(scene(forces=(lifted,)))}


def test_a_world_takes_the_place_of_another_one():
    faces = np.array(((0, 1, 2), (0, 2, 3)))
    first, second = world_markers([WorldSurface("ramp", SQUARE, faces)])
    assert first.action == first.DELETEALL
    assert (second.ns, second.header.frame_id, second.type) == ("ramp", "world", second.TRIANGLE_LIST)
    assert_allclose([xyz(point) for point in second.points], SQUARE[[0, 1, 2, 0, 2, 3]])
