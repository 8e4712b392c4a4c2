"""Memory that nobody owns for long: it outlives whoever made it, and everybody may write to it."""

from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.segment import Segment


def latched(path: Path, kind: str, layout: bytes, size: int) -> Segment:
    """The segment that there is, writable; a new one if there is none that can be used.

    Args:
        path: The file.
        kind: What the segment is for, at most 32 bytes.
        layout: Description of the content.
        size: Size of the content [B]; it is zero at first.

    Raises:
        MiddlewareError: It cannot be made, or a foreign file is in the way.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        return Segment.attach(path, kind, layout, writable=True)
    except MiddlewareError:
        try:
            return Segment.create(path, kind, layout, size)
        except MiddlewareError:  # another process was faster
            return Segment.attach(path, kind, layout, writable=True)
