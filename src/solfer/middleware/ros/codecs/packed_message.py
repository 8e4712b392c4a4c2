"""Packed messages with their header, as they go over the wire."""

import struct
import time

import numpy as np
from rospy.rostime import get_rostime, is_wallclock

MESSAGE_LENGTH = struct.Struct("<I")
MESSAGE_HEADER = struct.Struct("<IIII")
"""Sequence number, seconds, nanoseconds, and length of the frame's name that follows."""

TIME = struct.Struct("<II")
NANOSECONDS = 1_000_000_000
"""Nanoseconds of a second."""


_epoch: float | None = None


def set_epoch(epoch: float | None) -> None:
    """Set the ROS time at which the clock of what this process measures was zero [s]; None: there is no such clock."""
    global _epoch
    _epoch = epoch


def present() -> tuple[int, int]:
    """Return ROS time [s, ns]; of the wall clock without the objects of rospy, which cost as much as the packing."""
    if is_wallclock():
        return divmod(time.time_ns(), NANOSECONDS)
    now = get_rostime()
    return now.secs, now.nsecs


def stamp_of(measured: float) -> tuple[int, int]:
    """Return the stamp [s, ns] of what was measured at a time of this process [s], or the present if it is unknown."""
    return present() if _epoch is None or measured <= 0.0 else divmod(round(1e9 * (_epoch + measured)), NANOSECONDS)


class PackedMessage:
    """One message in a buffer of its own: its length, a std_msgs/Header, and a body. Only its numbers change.

    Args:
        body: Everything behind the header.
        name: Frame of reference, `frame_id` of the header; None: the type has no header.

    Attributes:
        bytes: The buffer.
    """

    def __init__(self, body: bytes, name: str | None = ""):
        self._stamped = name is not None
        header = b""
        if name is not None:
            encoded = name.encode()
            header = MESSAGE_HEADER.pack(0, 0, 0, len(encoded)) + encoded
        self.bytes = bytearray(MESSAGE_LENGTH.pack(len(header) + len(body)) + header + body)
        self._begin = MESSAGE_LENGTH.size + len(header)

    def number(self, number: int) -> None:
        """Set the sequence number of the header."""
        if self._stamped:
            MESSAGE_LENGTH.pack_into(self.bytes, 4, number & 0xFFFFFFFF)  # behind the length of the message

    def stamp(self, measured: float = 0.0) -> None:
        """Set the stamp of the header to when its numbers were measured [s], if that is known, else to the present."""
        TIME.pack_into(self.bytes, 8, *stamp_of(measured))  # behind the sequence number

    def numbers(self, offset: int, count: int) -> np.ndarray:
        """Return the `count` floats at `offset` of the body, a live view, shape (count,)."""
        return np.frombuffer(self.bytes, "<f8", count, self._begin + offset)
