"""solfer/Refusals: the senders whose commands a lower level refused, and the reasons."""

import io

from solfer.middleware.ros.codecs.base import Codec, packed_class, unpack
from solfer.middleware.ros.codecs.interfaces import message_class
from solfer.middleware.ros.codecs.packed_message import MESSAGE_HEADER, PackedMessage
from solfer.transport.messages import REFUSALS, RefusalMessage


class RefusalCodec(Codec):
    """One element of each array for each sender."""

    messages = (REFUSALS,)

    def __init__(self) -> None:
        self._type = message_class(REFUSALS)
        self.ros_class = packed_class(self._type)

    def encode(self, message: RefusalMessage) -> PackedMessage:
        """See `Codec.encode`; messages of this kind are rare."""
        buffer = io.BytesIO()
        published = self._type(owners=message.owners, claims=message.claims, reasons=message.reasons)
        published.serialize(buffer)
        frame = PackedMessage(buffer.getvalue()[MESSAGE_HEADER.size :])
        frame.stamp()
        return frame

    def decode(self, packed: bytes, sender: str) -> RefusalMessage:
        """See `Codec.decode`."""
        published = unpack(self._type, packed)
        claims = tuple(map(bool, published.claims))
        return RefusalMessage(
            tuple(published.owners),
            claims,
            tuple(published.reasons),
            stamp=published.header.stamp.to_sec(),
            sender=sender,
        )
