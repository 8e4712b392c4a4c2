"""A piece of memory that processes share: a file below /dev/shm with a header, one owner, and any number of others.

A segment is made whole under another name and then renamed, so that no process ever sees half of one. An owner that
makes it again, with another layout or after a crash, leaves the old memory to processes that still map it, and marks it
as retired. `multiprocessing.shared_memory` is not used: before Python 3.13 it deletes what others still need.
"""

import contextlib
import mmap
import os
from pathlib import Path
from typing import NamedTuple

from solfer.errors import MiddlewareError
from solfer.segments import files
from solfer.segments.header import (
    KIND_FIELD,
    LAYOUT_OFFSET,
    Word,
    check,
    is_ours,
    kind_of,
    padded,
    write_header,
)
from solfer.segments.lock import Lock, locked
from solfer.segments.words import require_order, words_of


class _Mapped(NamedTuple):
    """A mapped file: its memory, and which file it is."""

    memory: mmap.mmap
    identity: files.Identity


class Segment:
    """A mapped segment; `create` makes one, `attach` opens that of another.

    Attributes:
        path: The file.
        layout: The owner's description of the content.
        data: The content.
        pid: Process that made it.
        generation: How often a segment was made under this name.
    """

    def __init__(self, path: Path, mapped: _Mapped, lock: Lock | None = None):
        memory, self._identity = mapped
        self.path = path
        self._memory = memory
        self._lock = lock
        view = memoryview(memory)
        self._words = words_of(view[: KIND_FIELD.start])
        start = LAYOUT_OFFSET + padded(self._words[Word.TEXT])
        self.layout = bytes(view[LAYOUT_OFFSET : LAYOUT_OFFSET + self._words[Word.TEXT]])
        self.data = view[start:]
        self.pid = self._words[Word.PID]
        self.generation = self._words[Word.GENERATION]

    @classmethod
    def create(cls, path: Path, kind: str, layout: bytes, size: int) -> "Segment":
        """Make a segment and own it; what a dead owner left is replaced, with the next generation.

        Args:
            path: The file; its folder exists.
            kind: What the segment is for, at most 32 bytes.
            layout: Description of the content.
            size: Size of the content [B]; it is zero at first.

        Raises:
            MiddlewareError: Another process owns it, the file is not solfer's, or it cannot be made.
        """
        require_order()
        try:
            lock = Lock(path)
        except OSError as error:
            raise MiddlewareError(
                f"shared memory cannot be made: {error.strerror}", where=str(path), expected="room in /dev/shm"
            ) from error
        try:
            return cls(path, _replace(path, kind, layout, size=size), lock)
        except OSError as error:
            lock.release()
            raise MiddlewareError(
                f"shared memory cannot be made: {error.strerror}", where=str(path), expected="room in /dev/shm"
            ) from error
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
            MiddlewareError: There is none, it is damaged, or it is not what is expected.
        """
        require_order()
        try:
            mapped = _map(path, writable)
        except OSError as error:
            raise MiddlewareError(
                f"shared memory cannot be opened: {error.strerror}",
                where=str(path),
                expected="shared memory of your own user",
            ) from error
        check(path, mapped.memory, kind, layout=layout)
        return cls(path, mapped)

    def recreate(self, layout: bytes, size: int) -> "Segment":
        """Make the owner's next segment of this name, with another content; this one is retired.

        Raises:
            MiddlewareError: It cannot be made; this one stays.
        """
        try:
            mapped = _replace(self.path, kind_of(self._memory), layout, size=size)
        except OSError as error:
            raise MiddlewareError(
                f"shared memory cannot be made: {error.strerror}", where=str(self.path), expected="room in /dev/shm"
            ) from error
        lock = self._lock
        self._lock = None
        return Segment(self.path, mapped, lock)

    @property
    def retired(self) -> bool:
        """Whether the owner has given it up, or has made a newer one."""
        return bool(self._words[Word.RETIRED])

    @property
    def heartbeat(self) -> int:
        """Time of the owner's last heartbeat, in its monotonic clock [ns]; zero: never."""
        return self._words[Word.HEARTBEAT]

    def beat(self, time: int) -> None:
        """Set the owner's heartbeat to `time` [ns]."""
        self._words[Word.HEARTBEAT] = time

    def owned(self) -> bool:
        """Return whether the owner still holds it: false after its end, also after `kill -9`."""
        return not self.retired and locked(self.path)

    def in_place(self) -> bool:
        """Return whether its file is still where others look for it, and no other one."""
        return files.stands(self.path, self._identity)

    def leave(self) -> None:
        """Give up the ownership of memory that stays, also without an owner."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def close(self, for_good: bool = False) -> None:
        """Close it; the owner's segment is retired and removed. Views of its content stay valid.

        Args:
            for_good: No process will make one of this name again: nothing of it is left.
        """
        if self._lock is not None and self._lock.held:
            self._words[Word.RETIRED] = 1
            with contextlib.suppress(OSError, MiddlewareError):  # more than the file was removed
                if for_good:
                    self._lock.remove()
                else:
                    files.remove(self.path, only=self._identity)
            self._lock.release()
            self._lock = None


def _map(path: Path, writable: bool) -> _Mapped:
    """Map a whole file; an empty one is refused by the error of `mmap`, as too short."""
    file = files.open_file(path, os.O_RDWR if writable else os.O_RDONLY)
    try:
        return _Mapped(
            mmap.mmap(file, 0, access=mmap.ACCESS_WRITE if writable else mmap.ACCESS_READ), files.identity(file)
        )
    except ValueError as error:
        raise MiddlewareError("the file is empty", where=str(path), expected="shared memory of solfer") from error
    finally:
        os.close(file)


def _previous(path: Path) -> mmap.mmap | None:
    """Map what is at `path`, to be replaced.

    Raises:
        MiddlewareError: It is not solfer's.
    """
    try:
        memory = _map(path, writable=True).memory
    except FileNotFoundError:
        return None
    if not is_ours(memory):
        raise MiddlewareError("the file is not shared memory of solfer", where=str(path), expected="remove the file")
    return memory


def _replace(path: Path, kind: str, layout: bytes, size: int) -> _Mapped:
    """Put new memory at `path`; the caller holds the lock."""
    previous = _previous(path)
    words = words_of(memoryview(previous)[: KIND_FIELD.start]) if previous is not None else None
    generation = words[Word.GENERATION] + 1 if words is not None else 1
    draft = path.with_name(f"{path.name}.new")
    mapped = _allocate(draft, LAYOUT_OFFSET + padded(len(layout)) + padded(size))
    write_header(mapped.memory, kind.encode(), layout, generation=generation)
    files.replace(draft, path)
    if words is not None:
        words[Word.RETIRED] = 1
    return mapped


def _allocate(path: Path, total: int) -> _Mapped:
    """Allocate memory that is really there: a full /dev/shm is an error here and not a dead process later."""
    files.remove(path)
    file = files.make_file(path)
    try:
        os.posix_fallocate(file, 0, total)
        return _Mapped(mmap.mmap(file, total), files.identity(file))
    except OSError:
        files.remove(path)
        raise
    finally:
        os.close(file)
