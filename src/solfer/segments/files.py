"""Opens the files of a namespace: never through a link, and none that another user could have put there.

Shared memory is a place where every user may make folders. From the folder of the namespace on (`solfer-<name>`) each
step of a path is opened by itself, relative to the one before, and checked after it was opened: between a check of a
name and its opening, another user could replace what it names.
"""

import contextlib
import errno
import os
import pwd
import stat
from collections.abc import Iterator
from pathlib import Path

from solfer.errors import MiddlewareError

PREFIX = "solfer-"
FOLDER_MODE = 0o2770
"""Permissions of a folder for user and group, whatever the process' mask is; its files get its group."""

FOLDER_FLAGS = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
OPEN_FLAGS = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC  # a FIFO would block

Identity = tuple[int, int]
"""Device and number of a file, which no other file has while it is open or mapped."""


def identity(file: int) -> Identity:
    """Return the identity of an open file."""
    status = os.fstat(file)
    return status.st_dev, status.st_ino


def stands(path: Path, expected: Identity) -> bool:
    """Return whether the file or folder at `path` is still that very one."""
    try:
        status = os.stat(path, follow_symlinks=False)
    except OSError:
        return False
    return (status.st_dev, status.st_ino) == expected


def open_namespace(folder: Path, make: bool) -> int:
    """Open the folder of a namespace.

    Args:
        folder: The folder.
        make: Make it if there is none; then it has to belong to this user, or to root. Else it may also belong to a
            user whose group this process is in.

    Returns:
        A file descriptor.

    Raises:
        OSError: There is none, or it cannot be made or opened.
        MiddlewareError: It is a link, belongs to another user, or all users may write to it.
    """
    if make:
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=0o700)
    base = os.open(folder.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        opened = _step(base, folder.name, folder)
    except PermissionError:
        _check_folder(os.stat(folder.name, dir_fd=base, follow_symlinks=False), folder, make)  # names its owner
        raise
    finally:
        os.close(base)
    try:
        status = os.fstat(opened)
        _check_folder(status, folder, make)
        if make and status.st_uid == os.geteuid() and stat.S_IMODE(status.st_mode) != FOLDER_MODE:
            os.fchmod(opened, FOLDER_MODE)
    except BaseException:
        os.close(opened)
        raise
    return opened


def listed(folder: Path) -> list[str]:
    """List the names in a folder.

    Raises:
        OSError: It cannot be opened.
        MiddlewareError: It is not to be trusted.
    """
    with folder_of(folder / "any") as (opened, _):
        readable = os.open(".", FOLDER_FLAGS, dir_fd=opened)
        try:
            return os.listdir(readable)
        finally:
            os.close(readable)


def make_folders(path: Path) -> None:
    """Make the folders between the namespace's, which is never made here, and a file.

    Raises:
        OSError: They cannot be made.
        MiddlewareError: What is there is not to be trusted.
    """
    with folder_of(path, make=True):
        pass


def open_file(path: Path, flags: int = os.O_RDONLY) -> int:
    """Open a file that exists.

    Raises:
        OSError: There is none, or it cannot be opened.
        MiddlewareError: It is not to be trusted.
    """
    with folder_of(path) as (folder, name):
        return _open(folder, name, flags, where=path)


def make_file(path: Path) -> int:
    """Make a file that does not exist yet, to read and to write.

    Raises:
        OSError: There is one, or it cannot be made.
        MiddlewareError: Its folder is not to be trusted.
    """
    with folder_of(path) as (folder, name):
        return _make(folder, name)


def open_or_make(path: Path) -> int:
    """Open a file to read and to write; make it if there is none. See `open_file` and `make_file`."""
    with folder_of(path) as (folder, name):
        while True:
            with contextlib.suppress(FileNotFoundError):
                return _open(folder, name, os.O_RDWR, where=path)
            with contextlib.suppress(FileExistsError):
                return _make(folder, name)


def read(path: Path) -> bytes:
    """Read the content of a file; see `open_file`."""
    with open(open_file(path), "rb") as file:
        return file.read()


def replace(draft: Path, path: Path) -> None:
    """Replace a file with a complete draft from the same folder.

    Raises:
        OSError: It cannot be done.
        MiddlewareError: The folder is not to be trusted.
    """
    with folder_of(path) as (folder, name):
        os.rename(draft.name, name, src_dir_fd=folder, dst_dir_fd=folder)


def remove(path: Path, only: Identity | None = None) -> None:
    """Remove a file, if it is there.

    Args:
        path: The file.
        only: Keep what is not this very file: another process may have made one since.

    Raises:
        OSError: It cannot be removed.
        MiddlewareError: Its folder is not to be trusted.
    """
    with contextlib.suppress(FileNotFoundError), folder_of(path) as (folder, name):
        if only is not None:
            status = os.stat(name, dir_fd=folder, follow_symlinks=False)
            if (status.st_dev, status.st_ino) != only:
                return
        os.unlink(name, dir_fd=folder)


@contextlib.contextmanager
def folder_of(path: Path, make: bool = False) -> Iterator[tuple[int, str]]:
    """Open the folder of a file; yields its descriptor and the file's name in it.

    Args:
        path: The file.
        make: Make folders below that of the namespace that are not there.

    Raises:
        OSError: A folder is not there, or cannot be made.
        MiddlewareError: A folder is a link, or the namespace's belongs to another user.
    """
    base, folders = _split(path)
    opened = os.open(base, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        for depth, name in enumerate(folders):
            base = base / name
            made = make and depth > 0 and _made(opened, name)
            inner = _step(opened, name, base)
            os.close(opened)
            opened = inner
            if made:
                os.fchmod(opened, FOLDER_MODE)
            if not depth:
                _check_folder(os.fstat(opened), base, own=False)
        yield opened, path.name
    finally:
        os.close(opened)


def _split(path: Path) -> tuple[Path, tuple[str, ...]]:
    """Split a path: where the namespace's folder is, and the names from it down to the folder of the file."""
    parts = path.parent.parts
    for place, part in enumerate(parts):
        if part.startswith(PREFIX):
            return Path(*parts[:place]), parts[place:]
    return path.parent, ()


def _made(folder: int, name: str) -> bool:
    """Make a folder; returns False if there is one."""
    try:
        os.mkdir(name, 0o770, dir_fd=folder)
    except FileExistsError:
        return False
    return True


def _step(folder: int, name: str, where: Path) -> int:
    """Open a folder in a folder."""
    try:
        return os.open(name, FOLDER_FLAGS | os.O_NOFOLLOW, dir_fd=folder)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.ENOTDIR):
            raise _refused("not a folder, but a link or a file", where) from error
        raise


def _open(folder: int, name: str, flags: int, where: Path) -> int:
    """Open a file in a folder, and check what was opened."""
    try:
        file = os.open(name, flags | OPEN_FLAGS, dir_fd=folder)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise _refused("a link: what it leads to is not opened", where) from error
        raise
    try:
        _check_file(os.fstat(file), os.fstat(folder), where)
    except BaseException:
        os.close(file)
        raise
    return file


def _make(folder: int, name: str) -> int:
    """Make a file in a folder, with its mode."""
    mode = 0o660
    file = os.open(name, os.O_RDWR | os.O_CREAT | os.O_EXCL | OPEN_FLAGS, mode, dir_fd=folder)
    os.fchmod(file, mode)  # the mask of the process may have taken the group's part away
    return file


def _check_folder(status: os.stat_result, where: Path, own: bool) -> None:
    """Refuse the folder of a namespace in which other users could have put files."""
    me = os.geteuid()
    if status.st_mode & stat.S_IWOTH:
        raise _refused("a folder that all users may write to", where)
    if status.st_uid in (me, 0):
        return
    owner = f"a folder of {_user(status.st_uid)}, and this process runs as {_user(me)}"
    if own:
        raise _refused(owner, where, "one's own folder, or root's: the same user for all that make something there")
    if me and status.st_gid not in (os.getegid(), *os.getgroups()):
        raise _refused(owner, where, "one's own folder, root's, or one of a group that this process is in")


def _check_file(status: os.stat_result, home: os.stat_result, where: Path) -> None:
    """Refuse a file that was not made here by a user with permission."""
    if not stat.S_ISREG(status.st_mode):
        raise _refused("not a regular file", where)
    if status.st_nlink > 1:
        raise _refused("a file that has a second name elsewhere", where)
    if status.st_mode & stat.S_IWOTH:
        raise _refused("a file that all users may write to", where)
    if status.st_uid not in (os.geteuid(), 0, home.st_uid) and status.st_gid != home.st_gid:
        raise _refused(f"a file of {_user(status.st_uid)}", where)


def _user(number: int) -> str:
    """Format a user for a message."""
    try:
        return f"the user '{pwd.getpwuid(number).pw_name}'"
    except KeyError:
        return f"the user {number}"


def _refused(
    what: str, where: Path, expected: str = "shared memory of solfer: remove it, or use another namespace"
) -> MiddlewareError:
    return MiddlewareError(f"shared memory is refused: {what}", where=str(where), expected=expected)
