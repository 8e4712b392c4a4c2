"""A piece of memory that processes share: a file below /dev/shm with a header, one owner, and any number of others.

A segment is made whole under another name and then renamed, so that nobody ever sees half of one. An owner that makes
it anew, with another layout or after a crash, leaves the old memory to those who still look at it and marks it as
retired. `multiprocessing.shared_memory` is not used: before Python 3.13 it deletes what others still need.
"""

import enum
import hashlib
import mmap
import os
import platform
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.lock import Lock, locked

MAGIC = int.from_bytes(b"solferRT", "little")
VERSION = 1
HEADER = 128  # [B]
LINE = 64  # [B], of the processor's cache
KIND = slice(96, 128)
ORDERED = ("x86_64", "amd64", "i686", "i386")
"""Processors that keep the order of writes; on others a reader could see the new index before the new numbers."""


class Word(enum.IntEnum):
    """Places in the header, in words of 8 bytes."""

    MAGIC = 0
    VERSION = 1
    LAYOUT = 2
    PID = 3
    BOOT = 4
    GENERATION = 6
    HEARTBEAT = 7
    SIZE = 8
    RETIRED = 9
    TEXT = 10


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
        start = HEADER + _padded(self._words[Word.TEXT])
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
        _check(path, memory, kind, layout)
        return cls(path, memory)

    def recreate(self, layout: bytes, size: int) -> "Segment":
        """The owner's next segment of this name, with another content; this one is retired.

        Raises:
            MiddlewareError: It cannot be made; this one stays.
        """
        try:
            memory = _replace(self.path, _kind(self._memory), layout, size)
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

    def close(self) -> None:
        """Let go of it; the owner's segment is retired and removed. Views of its content stay valid."""
        if self._lock is not None and self._lock.held:
            self._words[Word.RETIRED] = 1
            self.path.unlink(missing_ok=True)
            self._lock.release()
            self._lock = None


def _require_order() -> None:
    if platform.machine().lower() not in ORDERED:
        raise MiddlewareError(f"shared memory is not safe on a {platform.machine()}: it may reorder writes",
                              expected=f"one of {', '.join(ORDERED)}, or the middleware ROS")


def _padded(size: int) -> int:
    return -(-size // LINE) * LINE


def _boot() -> bytes:
    """Number of this boot of the machine, 16 bytes."""
    return bytes.fromhex(Path("/proc/sys/kernel/random/boot_id").read_text().strip().replace("-", ""))


def _hash(layout: bytes) -> int:
    return int.from_bytes(hashlib.blake2b(layout, digest_size=8).digest(), "little", signed=True)


def _map(path: Path, writable: bool) -> mmap.mmap:
    """A whole file as memory; an empty one is refused by the error of `mmap`, as too short."""
    file = os.open(path, os.O_RDWR if writable else os.O_RDONLY)
    try:
        return mmap.mmap(file, 0, access=mmap.ACCESS_WRITE if writable else mmap.ACCESS_READ)
    except ValueError as error:
        raise MiddlewareError("the file is empty", where=str(path), expected="shared memory of solfer") from error
    finally:
        os.close(file)


def _kind(memory: mmap.mmap) -> str:
    return memory[KIND].rstrip(b"\0").decode(errors="replace")


def _is_ours(memory: mmap.mmap) -> bool:
    return len(memory) >= HEADER and int.from_bytes(memory[:8], "little") == MAGIC


def _check(path: Path, memory: mmap.mmap, kind: str, layout: bytes | None) -> None:
    """Raise a MiddlewareError unless the memory is what was asked for, whole."""
    where = str(path)
    if not _is_ours(memory):
        raise MiddlewareError("the file is no shared memory of solfer", where=where, expected="remove the file")
    words = memoryview(memory)[: KIND.start].cast("q")
    if words[Word.VERSION] != VERSION:
        raise MiddlewareError(f"shared memory of the version {words[Word.VERSION]}", where=where,
                              expected=f"version {VERSION}: the same solfer in all processes")
    if words[Word.SIZE] != len(memory):
        raise MiddlewareError(f"shared memory is damaged: {len(memory)} bytes", where=where,
                              expected=f"{words[Word.SIZE]} bytes; end its owner, process {words[Word.PID]}")
    if memory[8 * Word.BOOT : 8 * Word.BOOT + 16] != _boot():
        raise MiddlewareError("shared memory from before the machine was started", where=where,
                              expected="an owner that makes it anew")
    if _kind(memory) != kind:
        raise MiddlewareError(f"shared memory of the kind '{_kind(memory)}'", where=where, expected=f"'{kind}'")
    text = memory[HEADER : HEADER + words[Word.TEXT]]
    if _hash(text) != words[Word.LAYOUT]:
        raise MiddlewareError("shared memory is damaged: its layout is not the one it was made with", where=where,
                              expected=f"end its owner, process {words[Word.PID]}")
    if layout is not None and text != layout:
        raise MiddlewareError(f"shared memory of another layout: {text.decode(errors='replace')}", where=where,
                              expected=layout.decode(errors="replace"))


def _previous(path: Path) -> mmap.mmap | None:
    """What stands at `path`, to be replaced.

    Raises:
        MiddlewareError: It is none of ours.
    """
    if not path.exists():
        return None
    memory = _map(path, writable=True)
    if not _is_ours(memory):
        raise MiddlewareError("the file is no shared memory of solfer", where=str(path), expected="remove the file")
    return memory


def _replace(path: Path, kind: str, layout: bytes, size: int) -> mmap.mmap:
    """Put new memory at `path`; the caller holds the lock."""
    previous = _previous(path)
    words = memoryview(previous)[: KIND.start].cast("q") if previous is not None else None
    generation = words[Word.GENERATION] + 1 if words is not None else 1
    draft = path.with_name(f"{path.name}.new")
    memory = _allocate(draft, HEADER + _padded(len(layout)) + _padded(size))
    _write_header(memory, kind.encode(), layout, generation)
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


def _write_header(memory: mmap.mmap, kind: bytes, layout: bytes, generation: int) -> None:
    words = memoryview(memory)[: KIND.start].cast("q")
    words[Word.MAGIC], words[Word.VERSION], words[Word.LAYOUT] = MAGIC, VERSION, _hash(layout)
    words[Word.PID], words[Word.GENERATION] = os.getpid(), generation
    words[Word.SIZE], words[Word.TEXT] = len(memory), len(layout)
    memory[8 * Word.BOOT : 8 * Word.BOOT + 16] = _boot()
    memory[KIND] = kind.ljust(32, b"\0")
    memory[HEADER : HEADER + len(layout)] = layout
