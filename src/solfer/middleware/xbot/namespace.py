"""The folder in which processes find each other's segments, and a bell that says when to look again."""

import mmap
import os
import re
import time
from pathlib import Path
from urllib.parse import quote, unquote

from solfer.errors import MiddlewareError

SHARED_MEMORY = Path("/dev/shm")
BELL, BELL_SIZE = "bell", 64
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
            self._bell = self._open_bell()
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

    @property
    def bell(self) -> int:
        """A number that changes whenever a segment was made or has ended. Costs no call of the system."""
        return self._bell[0]

    def ring(self) -> None:
        """Say that a segment was made or has ended."""
        # a number that nobody else rings with: adding one would lose a ring if two rang at once
        self._bell[0] = (time.monotonic_ns() << 8 | os.getpid() & 0xFF) & LARGEST

    def _open_bell(self) -> memoryview:
        file = os.open(self.folder / BELL, os.O_RDWR | os.O_CREAT, 0o660)
        try:
            if os.fstat(file).st_size < BELL_SIZE:
                os.ftruncate(file, BELL_SIZE)
            return memoryview(mmap.mmap(file, BELL_SIZE)).cast("q")
        finally:
            os.close(file)


def _quoted(name: str) -> str:
    """A name as a file: without slashes, and none of the names that mean something to the file system."""
    file = quote(name.lstrip("/"), safe="").replace(".", "%2E") or "%"
    if len(file) > LONGEST:
        raise MiddlewareError(f"a name of {len(name)} letters is too long for shared memory: {name[:40]}...")
    return file
