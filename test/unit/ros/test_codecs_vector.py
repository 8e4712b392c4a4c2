"""The ROS codecs of points, vectors, orientations, poses and twists, against genpy's own serialisation."""

import io

import geometry_msgs.msg as geometry_messages
import numpy as np
import pytest
import rospy
from numpy.testing import assert_array_equal
from support.unit.genpy_messages import clock  # noqa: F401, a fixture

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.table import codec
from solfer.transport.messages import VECTOR_MESSAGES, VectorMessage

BODIES = {
    "geometry_msgs/PointStamped": "point",
    "geometry_msgs/Vector3Stamped": "vector",
    "geometry_msgs/QuaternionStamped": "quaternion",
    "geometry_msgs/PoseStamped": "pose",
    "geometry_msgs/TwistStamped": "twist",
}
"""Field that holds the numbers."""


def flat(element) -> list[float]:
    """List all numbers of a message in the order of the wire."""
    if not hasattr(element, "__slots__"):
        return [element]
    return [number for name in element.__slots__ for number in flat(getattr(element, name))]


def set_flat(element, numbers) -> None:
    """Set all numbers of a message from an iterator; the inverse of `flat`."""
    for name in element.__slots__:
        if hasattr(getattr(element, name), "__slots__"):
            set_flat(getattr(element, name), numbers)
        else:
            setattr(element, name, next(numbers))


def empty(name: str):
    return getattr(geometry_messages, name.split("/")[1])()


@pytest.mark.parametrize("name", VECTOR_MESSAGES)
def test_what_is_encoded_is_what_genpy_reads(name):
    values = np.arange(1.0, VECTOR_MESSAGES[name] + 1.0)
    frame = codec(name).encode(VectorMessage("wörld", values))
    read = empty(name).deserialize(bytes(frame.bytes[4:]))
    assert read.header.frame_id.encode() in ("wörld".encode(), b"w\xc3\xb6rld")
    assert flat(getattr(read, BODIES[name])) == values.tolist()


@pytest.mark.parametrize("name", VECTOR_MESSAGES)
def test_what_genpy_writes_is_decoded(name):
    message, values = empty(name), np.arange(1.0, VECTOR_MESSAGES[name] + 1.0)
    message.header.frame_id, message.header.stamp = "pelvis", rospy.Time(12, 500000000)
    set_flat(getattr(message, BODIES[name]), iter(values.tolist()))
    buffer = io.BytesIO()
    message.serialize(buffer)
    read = codec(name).decode(buffer.getvalue(), "/sender")
    assert (read.frame, read.stamp, read.sender) == ("pelvis", 12.5, "/sender")
    assert_array_equal(read.values, values)
    for broken in (buffer.getvalue()[:-1], buffer.getvalue() + b"\0", b"", buffer.getvalue()[:14]):
        with pytest.raises(PipeError, match="not a whole geometry_msgs"):
            codec(name).decode(broken, "")
