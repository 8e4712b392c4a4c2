"""Reads files that users name: only those with a content of their own, and never one that has to be waited for."""

import errno
import os
import stat
from typing import BinaryIO

FILE_BYTES = 64 << 20
"""Most bytes of a file that is read whole."""


def open_regular(path: str | os.PathLike) -> BinaryIO:
    """Open a file to read it, without ever waiting for a pipe, a device or the kernel.

    Raises:
        OSError: The file cannot be opened, or is none with a content of its own.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    kind = os.fstat(descriptor).st_mode
    if stat.S_ISREG(kind):
        return open(descriptor, "rb")
    os.close(descriptor)
    what = "folder" if stat.S_ISDIR(kind) else "device, a pipe or a socket"
    raise OSError(errno.EINVAL, f"it is a {what}", str(path))


def read_bytes(path: str | os.PathLike) -> bytes:
    """Read a whole file of up to `FILE_BYTES` bytes; see `open_regular`.

    Raises:
        OSError: The file cannot be read, or is larger.
    """
    with open_regular(path) as file:
        content = file.read(FILE_BYTES + 1)
    if content is None:
        raise OSError(errno.EAGAIN, "there is nothing to read yet", str(path))
    if len(content) > FILE_BYTES:
        raise OSError(errno.EFBIG, f"more than {FILE_BYTES >> 20} MiB", str(path))
    return content
