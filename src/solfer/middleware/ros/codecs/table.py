"""ROS messages to named numbers and back: the codec of each message."""

from solfer.middleware.ros.codecs.base import Codec
from solfer.middleware.ros.codecs.body import BodyCodec, ImuCodec, WrenchCodec
from solfer.middleware.ros.codecs.joint import JointCodec
from solfer.middleware.ros.codecs.refusal import RefusalCodec
from solfer.middleware.ros.codecs.vector import PointsCodec, VectorCodec
from solfer.transport.messages import IMU_MESSAGES, JOINT_MESSAGES, POINTS, REFUSALS, VECTOR_MESSAGES, WRENCH_MESSAGES

__all__ = ["Codec", "codec"]


def codec(message: str) -> Codec:
    """Make the codec of a message by its canonical name."""
    if message in JOINT_MESSAGES:
        return JointCodec(message)
    if message in VECTOR_MESSAGES:
        return VectorCodec(message)
    if message in IMU_MESSAGES:
        return ImuCodec()
    if message == POINTS:
        return PointsCodec()
    if message == REFUSALS:
        return RefusalCodec()
    return WrenchCodec() if message in WRENCH_MESSAGES else BodyCodec()
