"""The words by which processes agree: whole numbers in shared memory, accessed in order on each of our processors.

x86 keeps the order of reads, and that of writes. aarch64 keeps neither, so that fences do it there:

- The write of a word waits for all reads and writes before it: what it announces is there.
- All reads and writes after the read of a word wait for it, and for all reads before it. To check numbers, a reader
  therefore reads a word behind them, and then the word that shows whether they were overwritten (`Slots`).

A word has 8 aligned bytes, which a processor of 64 bits reads and writes at once.
"""

import os
from typing import Protocol

from solfer.errors import MiddlewareError

IN_ORDER = ("x86_64", "amd64", "i686", "i386")
"""Processors that keep the order."""

FENCED = ("aarch64",)
"""Processors that keep it with fences."""


class Words(Protocol):
    """Whole numbers at their places."""

    def __getitem__(self, place: int, /) -> int: ...

    def __setitem__(self, place: int, value: int, /) -> None: ...


class FencedWords:
    """Words on a processor that may reorder accesses.

    Args:
        words: The numbers.
    """

    def __init__(self, words: Words):
        from solfer.numerics.fences import acquire, release  # which x86 does not need

        self._words = words
        self._acquire = acquire
        self._release = release

    def __getitem__(self, place: int, /) -> int:
        word = self._words[place]
        self._acquire()
        return word

    def __setitem__(self, place: int, value: int, /) -> None:
        self._release()
        self._words[place] = value


def words_of(memory: memoryview) -> Words:
    """Return the words in shared memory, of which the size is a multiple of 8 bytes; on x86 the memory itself."""
    words = memory.cast("q")
    return words if _machine() in IN_ORDER else FencedWords(words)


def require_order() -> None:
    """Refuse a processor of which it is not known how to keep the order.

    Raises:
        MiddlewareError: It is one.
    """
    known = (*IN_ORDER, *FENCED)
    if _machine() not in known:
        raise MiddlewareError(
            f"shared memory is not safe on a {_machine()}: it may reorder reads and writes",
            expected=f"one of {', '.join(known)}, or the middleware ROS",
        )


def _machine() -> str:
    return os.uname().machine.lower()
