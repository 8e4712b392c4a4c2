"""Ownership of a file: a lock that the kernel takes back when its owner ends, however that happens."""

import fcntl
import os
import time
import weakref
from pathlib import Path

from solfer.errors import MiddlewareError
from solfer.segments import files

PID_SIZE = 32
"""Bytes for the number of the owner, which is all that the file of a lock holds."""

_HELD: "weakref.WeakSet[Lock]" = weakref.WeakSet()


class Lock:
    """Exclusive ownership of `path`, until `release` or the end of the process. A forked child does not inherit it.

    The lock is a file of its own beside `path`, which stays: the file itself may be replaced while it is owned.

    Args:
        path: What is owned.

    Raises:
        OSError: The folder cannot be written to.
        MiddlewareError: Another process owns it, or a foreign file is in the way.
    """

    def __init__(self, path: Path):
        self._path = path
        self._file = files.open_or_make(_lock_file(path))
        if os.fstat(self._file).st_size > PID_SIZE:
            os.close(self._file)
            raise MiddlewareError(
                "the file is not a lock of solfer", where=str(_lock_file(path)), expected="remove the file"
            )
        if not _try(self._file):
            owner = os.pread(self._file, PID_SIZE, 0).decode(errors="replace") or "of an unknown number"
            os.close(self._file)
            raise MiddlewareError(
                f"process {owner} writes here already, process {os.getpid()} may not",
                where=str(path),
                expected="one writer, or another namespace",
            )
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, str(os.getpid()).encode(), 0)
        _HELD.add(self)

    @property
    def held(self) -> bool:
        """Whether this process owns it; false in a forked child."""
        return self._file >= 0

    def remove(self) -> None:
        """Remove what is owned, and the lock's file: for names that no process owns a second time."""
        lock = _lock_file(self._path)
        if files.stands(lock, files.identity(self._file)):  # else another process owns it since
            files.remove(self._path)
            files.remove(lock)

    def release(self) -> None:
        """Give up the ownership."""
        if self.held:
            os.close(self._file)
            self._file = -1


def locked(path: Path) -> bool:
    """Return whether a process, this one included, owns `path`."""
    try:
        file = files.open_file(_lock_file(path))
    except (FileNotFoundError, MiddlewareError):  # a link or another user's file is not a lock
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(file)
    return False


def remove(path: Path) -> None:
    """Remove what a dead owner left under a name that no process owns a second time.

    Raises:
        MiddlewareError: A process owns it, or it cannot be removed.
    """
    try:
        lock = Lock(path)
        lock.remove()
    except OSError as error:
        raise MiddlewareError(
            f"shared memory cannot be removed: {error.strerror}",
            where=str(path),
            expected="shared memory of your own user; see /dev/shm",
        ) from error
    lock.release()


def _lock_file(path: Path) -> Path:
    return path.with_name(f"{path.name}.lock")


def _try(file: int) -> bool:
    attempts = 5
    for attempt in range(attempts):
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if attempt < attempts - 1:
                time.sleep(0.01)  # a process that only checks whether a lock is held has it for some microseconds
    return False


def _forget() -> None:
    """Drop the parent's locks in a forked child. Closing a copy of a file descriptor does not release its lock."""
    for lock in list(_HELD):
        lock.release()


os.register_at_fork(after_in_child=_forget)
