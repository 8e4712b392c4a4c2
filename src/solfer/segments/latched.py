"""Memory without a lasting owner: it outlives the process that made it, and every process may write to it."""

import contextlib
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.segments.segment import Segment


def latched(path: Path, kind: str, layout: bytes, size: int) -> Segment:
    """Open the segment at a path, writable; makes a new one if there is none that can be used.

    Args:
        path: The file; its folder exists.
        kind: What the segment is for, at most 32 bytes.
        layout: Description of the content.
        size: Size of the content [B]; it is zero at first.

    Raises:
        MiddlewareError: It cannot be made, or a foreign file is in the way.
    """
    try:
        return Segment.attach(path, kind, layout, writable=True)
    except MiddlewareError:
        try:
            return Segment.create(path, kind, layout, size=size)
        except MiddlewareError as refusal:
            with contextlib.suppress(MiddlewareError):  # another process may have been faster
                return Segment.attach(path, kind, layout, writable=True)
            raise refusal
