"""solfer/Refusals: whose commands a lower level refused, and why."""

import io

import rospy

from solfer.middleware.ros.codec import Codec, packed_class, unpack
from solfer.middleware.ros.frame import HEADER, Frame
from solfer.middleware.ros.interfaces import message_class
from solfer.pipes.messages import REFUSALS, RefusalMessage


class RefusalCodec(Codec):
    """One element of each array for each sender."""

    def __init__(self) -> None:
        self._type = message_class(REFUSALS)
        self.ros_class = packed_class(self._type)

    def encode(self, message: RefusalMessage) -> Frame:
        """See `Codec.encode`; messages of this kind are rare."""
        buffer = io.BytesIO()
        told = self._type(owners=message.owners, claims=message.claims, reasons=message.reasons)
        told.serialize(buffer)
        frame = Frame(buffer.getvalue()[HEADER.size :])
        frame.stamp(rospy.Time.now())
        return frame

    def decode(self, packed: bytes, sender: str) -> RefusalMessage:
        """See `Codec.decode`."""
        told = unpack(self._type, packed)
        claims = tuple(map(bool, told.claims))
        return RefusalMessage(tuple(told.owners), claims, tuple(told.reasons), told.header.stamp.to_sec(), sender)
