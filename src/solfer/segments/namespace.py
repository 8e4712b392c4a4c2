"""The folder in which processes find each other's segments, and bells that ring when these change."""

import mmap
import os
import re
import time
import zlib
from pathlib import Path
from urllib.parse import quote, unquote

from solfer.errors import MiddlewareError, UnknownName
from solfer.segments import files

SHARED_MEMORY = Path("/dev/shm")
BELLS = "bells"
BELLS_SIZE = 4096
ANY = 0
"""Place of the bell that rings with every other one."""


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
            self._bells, self._rung = self._open_bells()
        except OSError as error:
            raise self._unusable(error) from error

    def loss(self) -> str:
        """Describe what happened to the folder since it was opened; empty while new processes find it."""
        for path, opened in ((self.folder, self._folder), (self.folder / BELLS, self._rung)):
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

    def bell(self, *names: str) -> "Bell":
        """Return the bell of the segments in a folder."""
        place = zlib.crc32("/".join(map(_quoted, names)).encode()) % (len(self._bells) - 1)
        return Bell(self._bells, ANY + 1 + place)

    def any_bell(self) -> "Bell":
        """Return a bell that rings with every other one."""
        return Bell(self._bells, ANY)

    def _open_bells(self) -> tuple[memoryview, files.Identity]:
        path = self.folder / BELLS
        file = files.open_or_make(path)
        try:
            size = os.fstat(file).st_size
            if size not in (0, BELLS_SIZE):
                raise MiddlewareError(
                    f"the file does not hold solfer's bells: {size} bytes", where=str(path), expected="remove the file"
                )
            os.ftruncate(file, BELLS_SIZE)
            return memoryview(mmap.mmap(file, BELLS_SIZE)).cast("q"), files.identity(file)
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


class Bell:
    """Rings when a segment of a folder was made or has ended: without a ring there is nothing to search for.

    Args:
        words: Numbers of all bells; where two folders have the same one, some searches find nothing new.
        place: Which of them is this bell's.

    Attributes:
        words, place: See above.
        received: The bell's number when it was acknowledged last; another one than now: it rang since.
    """

    def __init__(self, words: memoryview, place: int):
        self.words = words
        self.place = place
        self.received = -1

    def rung(self) -> bool:
        """Return whether it rang since `acknowledge`, or ever if that was not called yet."""
        return self.words[self.place] != self.received

    def acknowledge(self) -> None:
        """Ignore the rings so far; to be called before the search."""
        self.received = self.words[self.place]

    def ring(self) -> None:
        """Announce that a segment was made or has ended; to be called afterwards."""
        # a number that no other process rings with: adding one would lose a ring if two rang at once
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
