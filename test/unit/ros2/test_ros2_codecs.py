"""Packed messages of `middleware: ROS2` against rclpy's own; needs the environment of `./run ros2`."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

from solfer.errors import PipeError  # noqa: E402
from solfer.middleware.ros2.codecs import codec, interface  # noqa: E402
from solfer.transport.messages import (  # noqa: E402
    VECTOR_MESSAGES,
    BodyMessage,
    FieldsMessage,
    ImuMessage,
    JointMessage,
    PointsMessage,
    RefusalMessage,
    VectorMessage,
    WrenchMessage,
    arrays,
)

DRAWN = np.random.default_rng(0)
NAMES = ("neck", "arm_1", "", "wheel_ü")


def drawn(*shape):
    return DRAWN.uniform(-1.0, 1.0, shape)


MESSAGES = {
    "sensor_msgs/JointState": JointMessage(NAMES, position=drawn(4), effort=drawn(4)),
    "solfer/JointCommand": JointMessage(
        NAMES, velocity=drawn(4), damping=drawn(4), interfaces=("bias", "x"), values=drawn(2, 4), component="first"
    ),
    "nav_msgs/Odometry": BodyMessage("world", "base", drawn(3), linear=drawn(3), pose_covariance=drawn(6, 6)),
    "sensor_msgs/Imu": ImuMessage("imu", angular=drawn(3), deviations=(0.1, 0.2, 0.3)),
    "geometry_msgs/WrenchStamped": WrenchMessage("foot", drawn(3), drawn(3)),
    "solfer/RobotPoints": PointsMessage("world", ("left", "right"), drawn(2, 3)),
    "solfer/Refusals": RefusalMessage(("a", "bc"), (True, False), ("why", "")),
    **{name: VectorMessage("world", drawn(size)) for name, size in VECTOR_MESSAGES.items()},
}


@pytest.mark.parametrize("name", MESSAGES)
def test_messages_are_those_of_ros(name):
    """Rclpy reads every field of what is packed here, and packs what is read here to the same numbers and names."""
    message, made = MESSAGES[name], codec(name)
    published = deserialize_message(made.encode(message), interface(name))
    if isinstance(message, JointMessage):
        assert tuple(published.name) == message.names
        for field in ("position", "velocity", "effort"):
            np.testing.assert_array_equal(
                getattr(published, field), getattr(message, field) if getattr(message, field) is not None else []
            )
    received = made.decode(bytes(serialize_message(published)), "sender")
    assert received.sender == "sender" and abs(received.stamp - published.header.stamp.sec) < 1.0
    for before, after in zip(arrays(message), arrays(received), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-15)
    for field in ("names", "interfaces", "component", "frame", "child", "owners", "claims", "reasons"):
        assert getattr(received, field, None) == getattr(message, field, None)


@pytest.mark.parametrize("name", MESSAGES)
def test_a_message_that_ends_too_early_is_refused(name):
    made = codec(name)
    packed = made.encode(MESSAGES[name])
    for length in range(len(packed)):
        with pytest.raises(PipeError):
            made.decode(packed[:length], "sender")


def test_messages_of_any_type_travel_by_their_fields():
    fields = {
        "level": 1,
        "nested": {
            "header": {"frame_id": "world", "stamp": 2.5},
            "poses": ({"position": {"x": 1.0, "y": 2.0, "z": 3.0}},),
        },
    }
    made = codec("geometry_msgs/PoseArray")
    packed = made.encode(FieldsMessage(fields["nested"]))
    received = made.decode(packed, "sender").fields
    assert received["header"]["frame_id"] == "world" and received["poses"][0]["position"] == {
        "x": 1.0,
        "y": 2.0,
        "z": 3.0,
    }
    with pytest.raises(PipeError, match="PoseArray"):
        made.encode(FieldsMessage({"poses": ({"position": {"x": "far"}},)}))
