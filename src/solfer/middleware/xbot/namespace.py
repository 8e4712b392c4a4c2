"""The folder in which processes find each other's segments, and bells that say when to look again."""

import mmap
import os
import re
import time
import zlib
from pathlib import Path
from urllib.parse import quote, unquote

from solfer.errors import MiddlewareError

SHARED_MEMORY = Path("/dev/shm")
BELLS, BELLS_SIZE = "bells", 4096
ANY = 0
"""Place of the bell that rings with every other one."""

LARGEST = 2**63 - 1
LONGEST = 240  # [letters]
HIDDEN = (".lock", ".new")


class Namespace:
    """Segments of one robot: a folder `solfer-<name>` with files below it.

    Args:
        name: Name of the namespace: letters, digits, `_`, `.` and `-`.
        root: Where the folder is; another place than shared memory is slower.

    Attributes:
        folder: The folder.

    Raises:
        MiddlewareError: The name is wrong, or the folder cannot be made.
    """

    def __init__(self, name: str = "solfer", root: Path = SHARED_MEMORY):
        if not re.fullmatch(r"[\w.-]+", name):
            raise MiddlewareError(f"no name of a namespace: '{name}'", expected="letters, digits, _ . -")
        self.folder = root / f"solfer-{name}"
        try:
            self.folder.mkdir(mode=0o770, exist_ok=True)
            self._bells = self._open_bells()
        except OSError as error:
            raise MiddlewareError(f"shared memory cannot be made: {error.strerror}", where=str(self.folder)) from error

    def path(self, *names: str) -> Path:
        """The path of a segment; `names` are folders and, last, the file, and may contain any characters."""
        return self.folder.joinpath(*map(_quoted, names))

    def place(self, *names: str) -> Path:
        """As `path`, for who makes the segment: its folder is there afterwards.

        Raises:
            MiddlewareError: The folder cannot be made.
        """
        path = self.path(*names)
        try:
            path.parent.mkdir(mode=0o770, parents=True, exist_ok=True)
        except OSError as error:
            raise MiddlewareError(f"shared memory cannot be made: {error.strerror}", where=str(path)) from error
        return path

    def present(self, *names: str) -> list[str]:
        """Names of the segments and folders in a folder, sorted."""
        try:
            files = os.listdir(self.path(*names))
        except FileNotFoundError:
            return []
        return sorted(unquote(file) for file in files if not file.endswith(HIDDEN))

    def bell(self, *names: str) -> "Bell":
        """The bell of the segments in a folder."""
        place = zlib.crc32("/".join(map(_quoted, names)).encode()) % (len(self._bells) - 1)
        return Bell(self._bells, ANY + 1 + place)

    def any_bell(self) -> "Bell":
        """A bell that rings with every other one."""
        return Bell(self._bells, ANY)

    def _open_bells(self) -> memoryview:
        file = os.open(self.folder / BELLS, os.O_RDWR | os.O_CREAT, 0o660)
        try:
            if os.fstat(file).st_size < BELLS_SIZE:
                os.ftruncate(file, BELLS_SIZE)
            return memoryview(mmap.mmap(file, BELLS_SIZE)).cast("q")
        finally:
            os.close(file)


class Bell:
    """Rings when a segment of a folder was made or has ended: who does not hear it need not look, and calls nothing.

    Args:
        words: Numbers of all bells; where two folders have the same one, some looks are in vain.
        place: Which of them is this bell's.
    """

    def __init__(self, words: memoryview, place: int):
        self._words, self._place, self._heard = words, place, -1

    def rung(self) -> bool:
        """Whether it rang since `hear`, which was perhaps never called."""
        return self._words[self._place] != self._heard

    def hear(self) -> None:
        """From now on only later rings count; to be called before one looks."""
        self._heard = self._words[self._place]

    def ring(self) -> None:
        """Say that a segment was made or has ended; to be called afterwards."""
        # a number that nobody else rings with: adding one would lose a ring if two rang at once
        self._words[self._place] = number = (time.monotonic_ns() << 8 | os.getpid() & 0xFF) & LARGEST
        self._words[ANY] = number


def _quoted(name: str) -> str:
    """A name as a file: without slashes, and none of the names that mean something to the file system."""
    file = quote(name.lstrip("/"), safe="").replace(".", "%2E") or "%"
    if len(file) > LONGEST:
        raise MiddlewareError(f"a name of {len(name)} letters is too long for shared memory: {name[:40]}...")
    return file
