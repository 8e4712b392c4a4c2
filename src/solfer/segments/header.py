"""The header of a segment: its kind, its owner, and the layout of what lies behind it."""

import enum
import mmap
import os
import zlib
from pathlib import Path

from solfer.errors import MiddlewareError

MAGIC = int.from_bytes(b"solferRT", "little")
VERSION = 2
LAYOUT_OFFSET = 128
"""Size of the header, behind which the layout lies as a text [B]."""

CACHE_LINE = 64
"""Size of a line of the processor's cache [B]."""

KIND_FIELD = slice(96, 128)
"""Bytes of the header that hold the kind."""


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


def padded(size: int) -> int:
    """Round a size up to whole lines of the processor's cache [B]."""
    return -(-size // CACHE_LINE) * CACHE_LINE


def boot() -> bytes:
    """Read the number of this boot of the machine, 16 bytes."""
    return bytes.fromhex(Path("/proc/sys/kernel/random/boot_id").read_text().strip().replace("-", ""))


def hash_of(layout: bytes) -> int:
    """Compute a number that identifies a layout."""
    return zlib.crc32(layout)


def kind_of(memory: mmap.mmap) -> str:
    """Return what a segment is for."""
    return memory[KIND_FIELD].rstrip(b"\0").decode(errors="replace")


def is_ours(memory: mmap.mmap) -> bool:
    """Return whether there is a header of solfer at all."""
    return len(memory) >= LAYOUT_OFFSET and int.from_bytes(memory[:8], "little") == MAGIC


def check(path: Path, memory: mmap.mmap, kind: str, layout: bytes | None) -> None:
    """Check that memory is whole and what was requested.

    Args:
        path: Its file, for messages.
        memory: The memory.
        kind: What it has to be for.
        layout: What its layout has to be; None: whatever it is.

    Raises:
        MiddlewareError: It is not.
    """
    where = str(path)
    if not is_ours(memory):
        raise MiddlewareError("the file is not shared memory of solfer", where=where, expected="remove the file")
    words = memoryview(memory)[: KIND_FIELD.start].cast("q")
    if words[Word.VERSION] != VERSION:
        raise MiddlewareError(
            f"shared memory of the version {words[Word.VERSION]}",
            where=where,
            expected=f"version {VERSION}: the same solfer in all processes",
        )
    if words[Word.SIZE] != len(memory):
        raise MiddlewareError(
            f"shared memory is damaged: {len(memory)} bytes",
            where=where,
            expected=f"{words[Word.SIZE]} bytes; end its owner, process {words[Word.PID]}",
        )
    if memory[8 * Word.BOOT : 8 * Word.BOOT + 16] != boot():
        raise MiddlewareError(
            "shared memory from before the machine was started", where=where, expected="an owner that makes it again"
        )
    if kind_of(memory) != kind:
        raise MiddlewareError(f"shared memory of the kind '{kind_of(memory)}'", where=where, expected=f"'{kind}'")
    text = memory[LAYOUT_OFFSET : LAYOUT_OFFSET + words[Word.TEXT]]
    if hash_of(text) != words[Word.LAYOUT]:
        raise MiddlewareError(
            "shared memory is damaged: its layout is not the one it was made with",
            where=where,
            expected=f"end its owner, process {words[Word.PID]}",
        )
    if layout is not None and text != layout:
        raise MiddlewareError(
            f"shared memory of another layout: {text.decode(errors='replace')}",
            where=where,
            expected=layout.decode(errors="replace"),
        )


def write_header(memory: mmap.mmap, kind: bytes, layout: bytes, generation: int) -> None:
    """Write the header of a new segment of this process."""
    words = memoryview(memory)[: KIND_FIELD.start].cast("q")
    words[Word.MAGIC] = MAGIC
    words[Word.VERSION] = VERSION
    words[Word.LAYOUT] = hash_of(layout)
    words[Word.PID] = os.getpid()
    words[Word.GENERATION] = generation
    words[Word.SIZE] = len(memory)
    words[Word.TEXT] = len(layout)
    memory[8 * Word.BOOT : 8 * Word.BOOT + 16] = boot()
    memory[KIND_FIELD] = kind.ljust(32, b"\0")
    memory[LAYOUT_OFFSET : LAYOUT_OFFSET + len(layout)] = layout
