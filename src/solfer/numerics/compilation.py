"""Compilation of small loops by numba, once for each machine."""

import contextlib
import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.runtime import rtsys
from numba.core.typeinfer import register_dispatcher

REORDERED = {"reassoc", "contract"}
"""How the compiler may reorder sums, to add several numbers at once; NaN and infinity stay what they are."""


class LoadingCache(FunctionCache):
    """A cache that loads functions without what only the compiler needs.

    Numba imports that before it loads the first function, which takes longer than all functions together; where one
    has to be compiled, the compiler does so by itself.

    Args:
        function: The function.
        sources: Other files whose functions it calls: Numba by itself notices a change of its own file alone.
    """

    def __init__(self, function: Callable[..., Any], sources: Iterable[Path]):
        super().__init__(function)
        self._cache_file._source_stamp = (self._cache_file._source_stamp, digest(sources))

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """Load a function; None where it is not in the cache."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def cached(
    signature: str, function: Callable[..., Any], fastmath: bool | set[str] = False, sources: Iterable[Path] = ()
) -> Callable[..., Any]:
    """Compile a function, or load it from the cache on disk; without a place for a cache it is compiled again.

    Args:
        signature: Types of result and arguments in numba's notation: nothing else is ever compiled.
        function: The function.
        fastmath: Freedom of the compiler with sums, `REORDERED` or nothing.
        sources: Other files whose functions it calls.
    """
    compiled: Any = njit(error_model="numpy", fastmath=fastmath)(function)
    if compiled is function:  # NUMBA_DISABLE_JIT is set
        return function
    with contextlib.suppress(RuntimeError):  # numba finds no folder that it may write to
        compiled._cache = LoadingCache(function, sources)
    with register_dispatcher(compiled):
        compiled.compile(signature)
        compiled.disable_compile()
    return compiled


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that other functions call when they are compiled; sums as in `REORDERED`."""
    return njit(error_model="numpy", fastmath=REORDERED)(function)


def exact_part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function as `part` does, with all operations as they are written."""
    return njit(error_model="numpy")(function)


def digest(sources: Iterable[Path]) -> str:
    """Hash several source files."""
    return hashlib.sha256(b"".join(source.read_bytes() for source in sorted(sources))).hexdigest()
