"""What may be declared for a recording, and the clear error that anything else gets."""

import numpy as np
import pytest

from solfer.errors import RecordingError, SizeMismatch, UnknownName
from solfer.recording.log import Logger
from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND, Channel


def test_arrays_are_declared_with_names_and_units():
    """Defaults of names, units and kind follow from the shape and the kind of what is added."""
    log = Logger("arm")
    log.section("log").add("error", np.zeros(2), ("x", "y"), ("m", "m/s"), "world")
    log.add("position", np.zeros(2), ("a", "b"), "rad", kind=JOINTS_KIND)
    log.add("counts", np.zeros((2, 2), dtype=np.int64), factor=1e-9)
    log.add("place", np.zeros(3), frame="world", kind="geometry_msgs/PointStamped")
    log.add("turn", np.zeros(3), unit="rad", kind="geometry_msgs/Vector3Stamped")
    log.add("named", np.zeros(3), ("x", "y", "z"), kind="geometry_msgs/PointStamped")
    channels = [source.channel for source in log.sources]
    assert [(each.name, each.kind, each.columns, each.units, each.frame) for each in channels] == [
        ("arm/log/error", COLUMNS_KIND, ("x", "y"), ("m", "m/s"), "world"),
        ("arm/position", JOINTS_KIND, ("a", "b"), ("rad", "rad"), ""),
        ("arm/counts", COLUMNS_KIND, ("0", "1", "2", "3"), ("",) * 4, ""),
        ("arm/place", "geometry_msgs/PointStamped", ("x", "y", "z"), ("m",) * 3, "world"),
        ("arm/turn", "geometry_msgs/Vector3Stamped", ("x", "y", "z"), ("rad",) * 3, ""),
        ("arm/named", "geometry_msgs/PointStamped", ("x", "y", "z"), ("",) * 3, ""),
    ]


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ((np.zeros(3), ("x", "y")), SizeMismatch, "2 columns for 3 numbers"),
        ((np.zeros(2), ("x", "y"), ("m",)), SizeMismatch, "1 units for 2 columns"),
        ((np.zeros(2, dtype=np.float32),), RecordingError, "an array of float32 that is contiguous"),
        ((np.zeros((2, 2))[:, 0],), RecordingError, "an array of float64 that is not contiguous"),
        ((np.zeros(1), (), "", "", "solfer/Columns"), UnknownName, "solfer_msgs/Columns"),
    ],
)
def test_wrong_declaration_is_one_clear_error(arguments, error, text):
    with pytest.raises(error) as caught:
        Logger("arm/log").add("error", *arguments)
    assert text in str(caught.value) and "channel 'arm/log/error'" in str(caught.value)


def test_name_can_be_declared_once():
    log = Logger("arm")
    log.add("error", np.zeros(1))
    with pytest.raises(RecordingError, match="declared twice"):
        log.add("error", np.zeros(1))


def test_shapes_of_a_channel_have_to_fit():
    with pytest.raises(SizeMismatch, match="values of the shape"):
        Channel("arm/x", COLUMNS_KIND, ("x",), ("",), "", np.zeros(2), np.zeros((2, 2)))
    with pytest.raises(UnknownName, match="unknown column 'y'"):
        Channel("arm/x", COLUMNS_KIND, ("x",), ("",)).column("y")
