"""Compilation of small loops by numba, once for each machine."""

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from numba import njit

REORDERED = {"reassoc", "contract"}
"""What the compiler may do with sums so that it adds several numbers at once; NaN and infinity stay what they are."""


def cached(signature: str, function: Callable[..., Any], fastmath: bool | set[str] = False) -> Callable[..., Any]:
    """The compiled function, from the cache on disk if it is there; without a place for a cache it is compiled anew.

    Args:
        signature: Types of result and arguments in numba's notation: nothing else is ever compiled.
        function: The function.
        fastmath: What the compiler may do with sums, `REORDERED` or nothing.
    """
    options = {"error_model": "numpy", "fastmath": fastmath}
    try:
        return njit(signature, cache=True, **options)(function)
    except RuntimeError:
        # numba finds no folder that it may write to
        return njit(signature, **options)(function)


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that those of its own file call when they are compiled; sums as in `REORDERED`."""
    return njit(error_model="numpy", fastmath=REORDERED)(function)


def digest(sources: Iterable[Path]) -> str:
    """Of several source files: numba's cache notices by itself a change only of the one that holds the function."""
    return hashlib.sha256(b"".join(source.read_bytes() for source in sorted(sources))).hexdigest()
