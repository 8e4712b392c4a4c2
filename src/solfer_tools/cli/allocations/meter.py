"""Measures how much memory each line of a cycle takes, and how much of it stays."""

import ctypes
import gc
import sys
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from types import CodeType, FrameType
from typing import Any

import numpy as np

from solfer_tools.cli.allocations.ownership import CodeOwner, Ownership

SMALLEST_PIECE = sys.getsizeof(np.empty(0))
"""Smallest piece of memory that counts [bytes]: an array, also one on the memory of another. Numbers are smaller."""

OFTEN = 0.1
"""How often a line takes memory in each cycle, at least, to count; a status that is sent now and then does not."""

KEPT_BYTES = 8.0
"""Least memory that a line keeps in each cycle, to be named [bytes]."""

# events of CPython's tracing
CALL = 0
LINE = 2
RETURN = 3
_EVENT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.py_object, ctypes.c_int, ctypes.c_void_p)
_set_trace = ctypes.pythonapi.PyEval_SetTrace
_set_trace.argtypes = (_EVENT, ctypes.py_object)
_set_trace.restype = None

Key = tuple[CodeType, int]


@dataclass
class LineCost:
    """What a line takes, all cycles together.

    Attributes:
        file, line, function: The line.
        times: How often it took memory.
        size: How much it took [bytes].
        kept: How much of it stayed [bytes].
        blamed: Whether the component is the reason: it is a line of it, or called from one.
        caller: File and line of the component from which another's line was called; empty: the plugin calls it.
    """

    file: str
    line: int
    function: str
    times: int = 0
    size: int = 0
    kept: int = 0
    blamed: bool = False
    caller: str = ""


class LineMeter:
    """Attributes memory to lines.

    Temporary memory is the peak of what Python has allocated since the line before, as `tracemalloc` reports. A trace
    that is set in C, unlike one of `sys.settrace`, hardly allocates, and what it does is measured and left out.

    Args:
        whose: Whose lines are named.

    Attributes:
        lines: What each line takes that allocates.
    """

    _OUTSIDE = None
    """What the stack has for the caller of the work."""

    _IGNORED = ()
    """What it has for stand-ins, with all that they call."""

    def __init__(self, whose: Ownership):
        self.lines: dict[tuple[str, int], LineCost] = {}
        self._whose, self._before = whose, tracemalloc.Snapshot((), 0)
        self._stack: list[Any] = [self._OUTSIDE]
        self._ended: FrameType | None = None
        self._base = 0
        self._own = 0
        self._counts = False
        self._callback = _EVENT(self._trace)
        self._probed = 0
        self._own = SMALLEST_PIECE - self._probe()

    def measure(self, work: Callable[[], object], counts: bool = True) -> None:
        """Do some work, and count what its lines take, if it `counts`."""
        tracemalloc.start()
        self._counts = counts
        self._stack[:] = [self._OUTSIDE]
        self._base = 0
        _set_trace(self._callback, None)
        try:
            work()
        finally:
            sys.settrace(None)
            tracemalloc.stop()
            self._ended = None

    def watch(self) -> None:
        """Watch from now on what is taken and given back; nothing else may be measured before `end`."""
        tracemalloc.start(12)  # calls that are remembered of memory that stays

    def begin(self) -> None:
        """Begin to count what stays; what is replaced in each cycle was taken under these eyes before."""
        gc.collect()
        self._before = tracemalloc.take_snapshot()

    def end(self, inside: str) -> None:
        """Count what lines have kept since `begin` of what they took below a function of the file `inside`."""
        gc.collect()
        kept = tracemalloc.take_snapshot().compare_to(self._before, "traceback")
        tracemalloc.stop()
        for each in kept:
            frame = self._named(each.traceback, inside)
            if frame is not None and each.size_diff:
                self._cost(frame.filename, frame.lineno, "").kept += each.size_diff

    def _trace(self, _: Any, frame: FrameType, event: int, __: Any) -> int:
        """Charge the line that was at work until this event, and note which one is at work from now on."""
        peak = tracemalloc.get_traced_memory()[1]
        stack = self._stack
        key = stack[-1]
        size = peak - self._base + self._own
        if event == CALL:
            size -= sys.getsizeof(frame)  # made for the trace alone
        if size >= SMALLEST_PIECE and key and self._counts:
            self._charge(key, size)
        if frame.f_code is _VIEW and event == LINE:
            self._probed = max(self._probed, size)
        if event == RETURN:
            stack.pop()
        elif event in (CALL, LINE):
            owner = self._whose.of(frame.f_code.co_filename)
            if event == CALL:
                stack.append(self._IGNORED if key is self._IGNORED or owner is CodeOwner.STAND_IN else key)
            if owner is CodeOwner.LINES and stack[-1] is not self._IGNORED:
                stack[-1] = frame.f_code, frame.f_lineno
        # what Python frees of a function that has ended would hide what its caller takes: it stays until the next event
        self._ended = frame if event == RETURN else None
        self._base = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        return 0

    def _charge(self, key: Key, size: int) -> None:
        code, line = key
        cost = self._cost(code.co_filename, line, code.co_name)
        cost.times = cost.times + 1
        cost.size = cost.size + size
        if not cost.blamed:
            callers = (each for each in reversed(self._stack) if each and self._whose.of_component(each[0].co_filename))
            cost.caller = next((f"{each[0].co_filename}:{each[1]}" for each in callers), "")
            cost.blamed = bool(cost.caller)

    def _cost(self, file: str, line: int, function: str) -> LineCost:
        found = self.lines.setdefault((file, line), LineCost(file, line, function))
        found.function, found.blamed = found.function or function, found.blamed or self._whose.of_component(file)
        return found

    def _named(self, calls: tracemalloc.Traceback, inside: str) -> tracemalloc.Frame | None:
        """Return the innermost line of the component's or of solfer's; None: a stand-in called it, or there is none."""
        files = [frame.filename for frame in calls]  # the outermost one first
        if inside not in files and len(calls) == calls.total_nframe:
            return None
        below = calls[len(files) - files[::-1].index(inside) :] if inside in files else calls
        owners = [self._whose.of(frame.filename) for frame in below]
        if CodeOwner.STAND_IN in owners or CodeOwner.LINES not in owners:
            return None
        return below[len(owners) - 1 - owners[::-1].index(CodeOwner.LINES)]

    def _probe(self) -> int:
        """Measure the size of a view, as the trace sees it [bytes]."""
        self.measure(_view)  # the first time, Python makes more than the view
        self._probed = 0
        self.measure(_view)
        return self._probed


_ARRAY = np.zeros(3)


def _view() -> None:
    view = _ARRAY[1:]
    del view


_VIEW = _view.__code__
