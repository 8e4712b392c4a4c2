"""The codec of solfer/Refusals against genpy's own serialisation."""

import io

import pytest
import rospy

import solfer.msg as solfer_messages
from solfer.errors import PipeError
from solfer.middleware.ros.codecs.table import codec
from solfer.transport.messages import REFUSALS, RefusalMessage


@pytest.fixture
def refusals(monkeypatch):
    """Make the codec, at a ROS time of 12.5 s without a node."""
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time(12, 500_000_000))
    return codec(REFUSALS)


def test_refusals_go_there_and_back(refusals):
    message = RefusalMessage(("/a", "/b"), (True, False), ("emergency stop", "zu weit: ä"))
    packed = bytes(refusals.encode(message).bytes)[4:]  # behind the length
    read = solfer_messages.Refusals().deserialize(packed)
    assert (read.owners, read.claims, read.reasons) == (list(message.owners), [True, False], list(message.reasons))
    decoded = refusals.decode(packed, "/simulator")
    assert (decoded.owners, decoded.claims, decoded.reasons) == (message.owners, message.claims, message.reasons)
    assert (decoded.stamp, decoded.sender) == (12.5, "/simulator")


def test_bytes_that_are_no_whole_message_are_refused(refusals):
    buffer = io.BytesIO()
    solfer_messages.Refusals(owners=["/a"], claims=[True], reasons=["why"]).serialize(buffer)
    for length in (0, 10, 18):  # in the header, and in the count of the owners
        with pytest.raises(PipeError, match="not a whole solfer/Refusals"):
            refusals.decode(buffer.getvalue()[:length], "/simulator")
