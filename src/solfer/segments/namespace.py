"""The folder in which processes find each other's segments, and notifications of changes of these."""

import mmap
import os
import re
import time
import zlib
from pathlib import Path
from urllib.parse import quote, unquote

from solfer.errors import MiddlewareError, UnknownName
from solfer.segments import files
from solfer.segments.words import Words, words_of

SHARED_MEMORY = Path("/dev/shm")
NOTIFICATIONS_FILE = "bells"
NOTIFICATIONS = 512
"""Numbers in that file."""
ANY = 0
"""Place of the notification that is sent with every other one."""


class Namespace:
    """Segments of one robot: a folder `solfer-<name>` with files below it.

    Args:
        name: Name of the namespace: letters, digits, `_`, `.` and `-`.
        root: Where the folder is; another place than shared memory is slower.
        make: Make the folder if there is none; then it has to belong to this user, or to root. A process that only
            reads and calls may also use that of a user whose group it is in.

    Attributes:
        name: The name.
        folder: The folder.

    Raises:
        MiddlewareError: The name is wrong, or the folder cannot be made, is a link or belongs to another user.
        UnknownName: There is no such namespace, and it is not to be made.
    """

    def __init__(self, name: str = "solfer", root: Path = SHARED_MEMORY, make: bool = True):
        if not re.fullmatch(r"[\w.-]+", name):
            raise MiddlewareError(f"invalid namespace name '{name}'", expected="letters, digits, _ . -")
        self.name = name
        self.folder = root / f"{files.PREFIX}{name}"
        try:
            opened = files.open_namespace(self.folder, make)
        except FileNotFoundError as error:
            if make:
                raise self._unusable(error) from error
            raise UnknownName("namespace", name, names(root), where=str(root)) from None
        except OSError as error:
            raise self._unusable(error) from error
        try:
            self._folder = files.identity(opened)
        finally:
            os.close(opened)
        try:
            self._numbers, self._numbers_file = self._open_numbers()
        except OSError as error:
            raise self._unusable(error) from error

    def loss(self) -> str:
        """Describe what happened to the folder since it was opened; empty while new processes find it."""
        for path, opened in ((self.folder, self._folder), (self.folder / NOTIFICATIONS_FILE, self._numbers_file)):
            if not files.stands(path, opened):
                return lost(path)
        return ""

    def path(self, *names: str) -> Path:
        """Return the path of a segment; `names` are folders and, last, the file, and may contain any characters."""
        return self.folder.joinpath(*map(_quoted, names))

    def place(self, *names: str) -> Path:
        """Return the path of a segment to be made, after making its folder; see `path`.

        Raises:
            MiddlewareError: The folder cannot be made.
        """
        path = self.path(*names)
        try:
            files.make_folders(path)
        except OSError as error:
            raise MiddlewareError(
                f"shared memory cannot be made: {error.strerror}",
                where=str(path),
                expected="room in /dev/shm, and a namespace of your own user",
            ) from error
        return path

    def present(self, *names: str) -> list[str]:
        """List the segments and folders in a folder, sorted."""
        try:
            present = files.listed(self.path(*names))
        except FileNotFoundError:
            return []
        return sorted(unquote(file) for file in present if not file.endswith((".lock", ".new")))

    def notification(self, *names: str) -> "Notification":
        """Return the notification of changes of the segments in a folder."""
        place = zlib.crc32("/".join(map(_quoted, names)).encode()) % (NOTIFICATIONS - 1)
        return Notification(self._numbers, ANY + 1 + place)

    def any_notification(self) -> "Notification":
        """Return the notification that is sent with every other one."""
        return Notification(self._numbers, ANY)

    def _open_numbers(self) -> tuple[Words, files.Identity]:
        path = self.folder / NOTIFICATIONS_FILE
        whole = 8 * NOTIFICATIONS  # [B]
        file = files.open_or_make(path)
        try:
            size = os.fstat(file).st_size
            if size not in (0, whole):
                raise MiddlewareError(
                    f"the file does not hold solfer's notifications: {size} bytes",
                    where=str(path),
                    expected="remove the file",
                )
            os.ftruncate(file, whole)
            return words_of(memoryview(mmap.mmap(file, whole))), files.identity(file)
        finally:
            os.close(file)

    def _unusable(self, error: OSError) -> MiddlewareError:
        return MiddlewareError(
            f"shared memory cannot be made: {error.strerror}",
            where=str(self.folder),
            expected="room in /dev/shm, and a namespace of your own user",
        )


def names(root: Path = SHARED_MEMORY) -> list[str]:
    """List the names of all namespaces, sorted."""
    return sorted(name.removeprefix(files.PREFIX) for name in os.listdir(root) if name.startswith(files.PREFIX))


def lost(path: Path) -> str:
    """Describe, for a message, a file or folder that is not where it was opened any more."""
    return f"{path} was {'replaced' if os.path.lexists(path) else 'removed'} while it was in use"


class Notification:
    """Reports that a segment of a folder was made or has ended: until then there is nothing to search for.

    Args:
        words: Numbers of all notifications; where two folders have the same one, some searches find nothing new.
        place: Which of them is that of this one.

    Attributes:
        words, place: See above.
        received: Its number when it was acknowledged last; another one than now: it was sent since.
    """

    def __init__(self, words: Words, place: int):
        self.words = words
        self.place = place
        self.received = -1

    def is_pending(self) -> bool:
        """Return whether it was sent since `acknowledge`, or ever if that was not called yet."""
        return self.words[self.place] != self.received

    def acknowledge(self) -> None:
        """Ignore what was sent so far; to be called before the search."""
        self.received = self.words[self.place]

    def send(self) -> None:
        """Announce that a segment was made or has ended; to be called afterwards."""
        # a number that no other process sends: adding one would lose one of two that are sent at once
        self.words[self.place] = number = (time.monotonic_ns() << 8 | os.getpid() & 0xFF) & (2**63 - 1)
        self.words[ANY] = number


def _quoted(name: str) -> str:
    """Quote a name as a file's: without slashes, and none of the names that mean something to the file system."""
    file = quote(name.lstrip("/"), safe="").replace(".", "%2E") or "%"
    if len(file) > 240:  # file systems take 255 bytes, and the lock's name is longer
        raise MiddlewareError(
            f"a name of {len(name)} letters is too long for shared memory: {name[:40]}...", expected="a shorter name"
        )
    return file
