"""The codec of solfer/Refusals against genpy's own serialisation."""

import io

import pytest

from solfer.errors import PipeError
from solfer.pipes.messages import REFUSALS, RefusalMessage

rospy = pytest.importorskip("rospy")
solfer_messages = pytest.importorskip("solfer.msg", reason="made by a catkin build")

from solfer.middleware.ros.codecs import codec  # noqa: E402


@pytest.fixture
def refusals(monkeypatch):
    """The codec, at a ROS time of 12.5 s without a node."""
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time(12, 500_000_000))
    return codec(REFUSALS)


def test_what_is_encoded_is_what_genpy_reads_and_what_is_decoded(refusals):
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
        with pytest.raises(PipeError, match="no whole solfer/Refusals"):
            refusals.decode(buffer.getvalue()[:length], "/simulator")
