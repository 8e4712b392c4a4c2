"""Compilation, once for each machine."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit


def cached(signature: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The compiled function, from the cache on disk if it is there; without a place for a cache it is compiled anew."""
    try:
        return njit(signature, cache=True, error_model="numpy")(function)
    except RuntimeError:
        # numba finds no folder that it may write to
        return njit(signature, error_model="numpy")(function)


def digest() -> str:
    """Of all sources of this package. numba's cache notices by itself a change only of the file of the function."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()
