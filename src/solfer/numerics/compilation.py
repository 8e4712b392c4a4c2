"""Compilation of small loops by numba, once for each machine."""

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from numba import njit

REORDERED = {"reassoc", "contract"}
"""How the compiler may reorder sums, to add several numbers at once; NaN and infinity stay what they are."""


def cached(signature: str, function: Callable[..., Any], fastmath: bool | set[str] = False) -> Callable[..., Any]:
    """Compile a function, or load it from the cache on disk; without a place for a cache it is compiled anew.

    Args:
        signature: Types of result and arguments in numba's notation: nothing else is ever compiled.
        function: The function.
        fastmath: Freedom of the compiler with sums, `REORDERED` or nothing.
    """
    options: dict[str, Any] = {"error_model": "numpy", "fastmath": fastmath}
    try:
        return njit(signature, cache=True, **options)(function)
    except RuntimeError:
        # numba finds no folder that it may write to
        return njit(signature, **options)(function)


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that functions of its own file call when they are compiled; sums as in `REORDERED`."""
    return njit(error_model="numpy", fastmath=REORDERED)(function)


def digest(sources: Iterable[Path]) -> str:
    """Hash several source files: numba's cache by itself notices a change only of the file with the function."""
    return hashlib.sha256(b"".join(source.read_bytes() for source in sorted(sources))).hexdigest()
