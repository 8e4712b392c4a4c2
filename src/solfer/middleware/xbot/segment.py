"""A piece of memory that processes share: a file below /dev/shm with a header, one owner, and any number of others.

A segment is made whole under another name and then renamed, so that nobody ever sees half of one. An owner that makes
it anew, with another layout or after a crash, leaves the old memory to those who still look at it and marks it as
retired. `multiprocessing.shared_memory` is not used: before Python 3.13 it deletes what others still need.
"""

import mmap
import os
import platform
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.header import HEADER, KIND, Word, check, is_ours, kind_of, padded, write_header
from solfer.middleware.xbot.lock import Lock, locked

ORDERED = ("x86_64", "amd64", "i686", "i386")
"""Processors that keep the order of writes; on others a reader could see the new index before the new numbers."""


class Segment:
    """A mapped segment; `create` makes one, `attach` opens that of another.

    Attributes:
        path: The file.
        layout: What the owner says about the content.
        data: The content.
        pid: Process that made it.
        generation: How often a segment was made under this name.
    """

    def __init__(self, path: Path, memory: mmap.mmap, lock: Lock | None = None):
        self.path, self._memory, self._lock = path, memory, lock
        view = memoryview(memory)
        self._words = view[: KIND.start].cast("q")
        start = HEADER + padded(self._words[Word.TEXT])
        self.layout = bytes(view[HEADER : HEADER + self._words[Word.TEXT]])
        self.data = view[start:]
        self.pid, self.generation = self._words[Word.PID], self._words[Word.GENERATION]

    @classmethod
    def create(cls, path: Path, kind: str, layout: bytes, size: int) -> "Segment":
        """Make a segment and own it; what a dead owner left is replaced, with the next generation.

        Args:
            path: The file; its folder exists.
            kind: What the segment is for, at most 32 bytes.
            layout: Description of the content.
            size: Size of the content [B]; it is zero at first.

        Raises:
            MiddlewareError: Another process owns it, the file is none of ours, or it cannot be made.
        """
        _require_order()
        try:
            lock = Lock(path)
        except OSError as error:
            raise MiddlewareError(f"shared memory cannot be made: {error.strerror}", where=str(path)) from error
        try:
            return cls(path, _replace(path, kind, layout, size), lock)
        except OSError as error:
            lock.release()
            raise MiddlewareError(f"shared memory cannot be made: {error.strerror}", where=str(path)) from error
        except MiddlewareError:
            lock.release()
            raise

    @classmethod
    def attach(cls, path: Path, kind: str, layout: bytes | None = None, writable: bool = False) -> "Segment":
        """Open a segment of another.

        Args:
            path: The file.
            kind: What it has to be for.
            layout: What its layout has to be; None: whatever it is.
            writable: Whether the content may be written to.

        Raises:
            MiddlewareError: There is none, it is damaged, or it is not what was asked for.
        """
        _require_order()
        try:
            memory = _map(path, writable)
        except OSError as error:
            raise MiddlewareError(f"shared memory cannot be opened: {error.strerror}", where=str(path)) from error
        check(path, memory, kind, layout)
        return cls(path, memory)

    def recreate(self, layout: bytes, size: int) -> "Segment":
        """The owner's next segment of this name, with another content; this one is retired.

        Raises:
            MiddlewareError: It cannot be made; this one stays.
        """
        try:
            memory = _replace(self.path, kind_of(self._memory), layout, size)
        except OSError as error:
            raise MiddlewareError(f"shared memory cannot be made: {error.strerror}", where=str(self.path)) from error
        lock, self._lock = self._lock, None
        return Segment(self.path, memory, lock)

    @property
    def retired(self) -> bool:
        """Whether the owner has given it up, or has made a newer one."""
        return bool(self._words[Word.RETIRED])

    @property
    def heartbeat(self) -> int:
        """When the owner said last that it lives, in its monotonic clock [ns]; zero: never."""
        return self._words[Word.HEARTBEAT]

    def beat(self, time: int) -> None:
        """The owner lives at `time` [ns]."""
        self._words[Word.HEARTBEAT] = time

    def owned(self) -> bool:
        """Whether the owner still holds it: false after its end, also after `kill -9`."""
        return not self.retired and locked(self.path)

    def close(self, for_good: bool = False) -> None:
        """Let go of it; the owner's segment is retired and removed. Views of its content stay valid.

        Args:
            for_good: Nobody will make one of this name again: nothing of it is left.
        """
        if self._lock is not None and self._lock.held:
            self._words[Word.RETIRED] = 1
            if for_good:
                self._lock.remove()
            else:
                self.path.unlink(missing_ok=True)
            self._lock.release()
            self._lock = None


def _require_order() -> None:
    if platform.machine().lower() not in ORDERED:
        raise MiddlewareError(f"shared memory is not safe on a {platform.machine()}: it may reorder writes",
                              expected=f"one of {', '.join(ORDERED)}, or the middleware ROS")


def _map(path: Path, writable: bool) -> mmap.mmap:
    """A whole file as memory; an empty one is refused by the error of `mmap`, as too short."""
    file = os.open(path, os.O_RDWR if writable else os.O_RDONLY)
    try:
        return mmap.mmap(file, 0, access=mmap.ACCESS_WRITE if writable else mmap.ACCESS_READ)
    except ValueError as error:
        raise MiddlewareError("the file is empty", where=str(path), expected="shared memory of solfer") from error
    finally:
        os.close(file)


def _previous(path: Path) -> mmap.mmap | None:
    """What stands at `path`, to be replaced.

    Raises:
        MiddlewareError: It is none of ours.
    """
    if not path.exists():
        return None
    memory = _map(path, writable=True)
    if not is_ours(memory):
        raise MiddlewareError("the file is no shared memory of solfer", where=str(path), expected="remove the file")
    return memory


def _replace(path: Path, kind: str, layout: bytes, size: int) -> mmap.mmap:
    """Put new memory at `path`; the caller holds the lock."""
    previous = _previous(path)
    words = memoryview(previous)[: KIND.start].cast("q") if previous is not None else None
    generation = words[Word.GENERATION] + 1 if words is not None else 1
    draft = path.with_name(f"{path.name}.new")
    memory = _allocate(draft, HEADER + padded(len(layout)) + padded(size))
    write_header(memory, kind.encode(), layout, generation)
    draft.rename(path)
    if words is not None:
        words[Word.RETIRED] = 1
    return memory


def _allocate(path: Path, total: int) -> mmap.mmap:
    """Memory that is really there: a full /dev/shm is an error here and not a dead process later."""
    path.unlink(missing_ok=True)
    file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o660)
    try:
        os.posix_fallocate(file, 0, total)
        return mmap.mmap(file, total)
    except OSError:
        path.unlink(missing_ok=True)
        raise
    finally:
        os.close(file)


