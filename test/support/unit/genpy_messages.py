"""Messages as genpy serialises them, in a process that is no node."""

import io

import pytest
import rospy


@pytest.fixture(autouse=True)
def clock():
    """ROS time without a node."""
    rospy.rostime.set_rostime_initialized(True)
    yield
    rospy.rostime.set_rostime_initialized(False)


def packed(message) -> bytes:
    """Serialise a message by genpy."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
