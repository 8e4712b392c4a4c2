"""The ground that is felt: what cannot be true changes nothing, and silence is named once."""

import math

import numpy as np
import pytest

from solfer.components.felt_ground import SILENCE, FeltGround
from solfer.errors import ComponentError
from solfer.interfaces.geometry import Header, Vector
from solfer.interfaces.ground import GroundEstimate

UP = np.tile((0.0, 0.0, 1.0), (2, 1))
SLOPE = Vector(-0.6, 0.0, 0.8)
STEEP = Vector(math.sin(1.1), 0.0, math.cos(1.1))


def made():
    return FeltGround("squat", "odometry/ground", ("left", "right"), UP)


def test_normals_go_by_name_and_others_by_the_plane():
    felt = made()
    felt.receive(GroundEstimate(names=("right", "tail"), normals=(SLOPE, SLOPE)))
    assert felt.normals.tolist() == [[0.0, 0.0, 1.0], [-0.6, 0.0, 0.8]]
    felt.receive(GroundEstimate(normal=SLOPE))
    assert felt.normals.tolist() == [[-0.6, 0.0, 0.8]] * 2
    felt.start()
    assert np.array_equal(felt.normals, UP)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"header": Header(frame_id="base_link")}, "in the frame 'base_link'\n  expected: the frame 'odom'"),
        ({"header": Header()}, "in the frame ''"),
        ({"names": ("left", "right")}, "2 names and 1 normals"),
        ({"normals": (Vector(math.nan, 0.0, 1.0),)}, r"the normal \(nan, 0, 1\) of 'left'"),
        ({"normals": (Vector(0.0, 0.0, 2.0),)}, "of 'left'\n  expected: three numbers of length 1"),
        ({"normals": (Vector(z=-1.0),)}, "of 'left' that is 180 deg from the vertical\n  expected: at most 60 deg"),
        ({"normal": STEEP}, "the plane that is 63 deg from the vertical"),
    ],
)
def test_a_ground_that_cannot_be_is_refused_whole(fields, text):
    felt = made()
    right = {"names": ("left",), "normals": (SLOPE,)}
    felt.receive(GroundEstimate(**right))
    before = felt.normals.copy()
    with pytest.raises(ComponentError, match=text):
        felt.receive(GroundEstimate(**{**right, "normal": SLOPE, **fields}))
    assert np.array_equal(felt.normals, before)


def test_silence_is_named_once(caplog):
    felt = made()
    for _ in range(300):
        felt.update(0.005)
    felt.receive(GroundEstimate())
    felt.update(0.9 * SILENCE)
    assert caplog.messages == ["squat: odometry/ground is silent for 0.5 s; the ground counts as it was"]
