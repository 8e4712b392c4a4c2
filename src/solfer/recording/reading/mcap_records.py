"""The records of an MCAP file, also of one whose writer was killed."""

import io
import os
import struct
from collections.abc import Iterator, Set
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Footer
from mcap.writer import MCAP0_MAGIC

from solfer.errors import RecordingError, SolferError, described

HEAD = struct.Struct("<BQ")
"""Head of a record: opcode, length."""

EXPECTED = "a file that `solfer record` made"
"""What is expected of a file that is no recording."""

_READ_ERRORS = (
    ValueError,
    TypeError,
    AttributeError,
    LookupError,
    ArithmeticError,
    RecursionError,
    struct.error,
    McapError,
)


class McapRecords:
    """Where records are, and their contents, which are not looked at.

    Args:
        file: The file.

    Attributes:
        place: What is being read, for errors.
        size: Bytes of the file.
        missing: What the file lacks, a sentence each.
    """

    def __init__(self, file: BinaryIO):
        self._file = file
        self.place = ""
        self.size = os.fstat(file.fileno()).st_size
        self.missing: list[str] = []

    def all(self, kinds: Set[int]) -> Iterator[tuple[int, int, bytes]]:
        """Yield the place, opcode and content of each record of some kinds.

        Raises:
            RecordingError: It is no MCAP file.
        """
        self._file.seek(0)
        if self._file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise RecordingError("this is no MCAP file", expected=EXPECTED)
        yield from self._of(self._file, self.size - len(MCAP0_MAGIC), kinds)

    def at(self, place: int, size: int, kinds: Set[int]) -> Iterator[tuple[int, bytes]]:
        """Yield opcodes and contents of the records in a part of the file."""
        if place + size > self.size:
            raise ValueError(f"{size} bytes at byte {place} of {self.size}")
        self._file.seek(place)
        for _, opcode, content in self._of(io.BytesIO(self._file.read(size)), size, kinds):
            yield opcode, content

    def summary(self) -> tuple[int, int] | None:
        """Return place and size of the part that lists all others; None: the file's writer came to no end."""
        footer = HEAD.size + 20
        end = self.size - footer - len(MCAP0_MAGIC)
        if end < len(MCAP0_MAGIC):
            return None
        self._file.seek(end)
        tail = self._file.read(footer + len(MCAP0_MAGIC))
        if tail[0] != Opcode.FOOTER or tail[footer:] != MCAP0_MAGIC:
            return None
        begin = Footer.read(ReadDataStream(io.BytesIO(tail[HEAD.size :]))).summary_start
        if not len(MCAP0_MAGIC) <= begin <= end:
            raise ValueError(f"a summary at byte {begin} of {self.size}")
        return begin, end - begin

    def _of(self, file: BinaryIO, rest: int, kinds: Set[int]) -> Iterator[tuple[int, int, bytes]]:
        """Yield place, opcode and content of the records of a stream. A part of one at the end is left out."""
        while rest > 0:
            place = file.tell()
            self.place = f"byte {place}"
            head = file.read(HEAD.size)
            opcode, length = HEAD.unpack(head.ljust(HEAD.size, b"\0"))
            if len(head) < HEAD.size or length > rest - HEAD.size:
                self.missing.append(f"an unfinished record of {rest} bytes at the end")
                return
            if not opcode or length > 1 << 25:  # [B] solfer's own have some hundred kB
                raise ValueError(f"a record of the kind {opcode} with {length} bytes")
            if opcode in kinds:
                yield place, opcode, file.read(length)
            else:
                file.seek(length, os.SEEK_CUR)
            rest -= HEAD.size + length


@contextmanager
def file_named(path: Path) -> Iterator[None]:
    """Name the file that the system does not read."""
    try:
        yield
    except OSError as error:
        raise RecordingError(
            f"the recording cannot be read: {error.strerror}", where=str(path), expected=EXPECTED
        ) from error


@contextmanager
def place_named(path: Path, records: McapRecords) -> Iterator[None]:
    """Name the place at which a file is damaged."""
    try:
        yield
    except SolferError as error:
        where = ": ".join(filter(None, (str(path), records.place, error.where)))
        raise RecordingError(error.what, where=where, expected=error.expected) from error
    except _READ_ERRORS as error:
        what = f"the recording is damaged: {described(error)}"
        raise RecordingError(what, where=f"{path}: {records.place}", expected=EXPECTED) from error
