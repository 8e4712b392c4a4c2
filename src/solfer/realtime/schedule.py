"""Real-time scheduling of a process by the kernel. Every measure is optional, and may be refused without harm."""

import contextlib
import ctypes
import errno
import gc
import os
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

LATENCY = "/dev/cpu_dma_latency"
"""File that keeps the processors out of deep sleep while it is open."""


@dataclass(frozen=True)
class ScheduleRequest:
    """The requested measures.

    Attributes:
        priority: Priority in SCHED_FIFO, 1 to 99; 0: the ordinary scheduler.
        cpus: Processors that the process keeps to; empty: all.
        lock_memory: Whether no page may be swapped out.
        timer_slack: How much later the kernel may wake the process [ns]; 0: unchanged.
        cpu_latency: Whether the processors are kept out of deep sleep.
        freeze_collector: Whether the garbage collector is off while the loop runs.
    """

    priority: int = 60
    cpus: tuple[int, ...] = ()
    lock_memory: bool = True
    timer_slack: int = 1
    cpu_latency: bool = True
    freeze_collector: bool = True


@dataclass
class Schedule:
    """The result of a request; to be closed when the loop is over.

    Attributes:
        granted: Measures in force.
        refused: Refused measures, each with the reason.
    """

    granted: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    _undo: list[Callable[[], object]] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Both in one line."""
        lacks = f"; without {', '.join(self.refused)}" if self.refused else ""
        return f"{', '.join(self.granted) or 'ordinary'}{lacks}"

    def attempt(self, name: str, measure: Callable[[], object], undo: Callable[[], object] | None = None) -> None:
        """Take a measure; the system may refuse it."""
        try:
            measure()
        except OSError as error:
            self.refused.append(f"{name} ({error.strerror or error})")
            return
        self.granted.append(name)
        if undo is not None:
            self._undo.append(undo)

    def close(self) -> None:
        """Undo all measures."""
        while self._undo:
            with contextlib.suppress(OSError):  # at the latest it ends with the process
                self._undo.pop()()


def apply(request: ScheduleRequest) -> Schedule:
    """Apply the requested measures as far as the kernel grants them; never fails."""
    pr_set_timerslack = 29  # of sys/prctl.h
    mcl_current = 1  # of sys/mman.h
    mcl_future = 2
    schedule = Schedule()
    if request.freeze_collector:
        schedule.attempt("collector frozen", _freeze, _thaw)
    if request.timer_slack:
        schedule.attempt(
            f"timer slack {request.timer_slack} ns",
            lambda: _libc("prctl", pr_set_timerslack, ctypes.c_ulong(request.timer_slack)),
        )
    if request.lock_memory:
        schedule.attempt(
            "memory locked", lambda: _libc("mlockall", mcl_current | mcl_future), lambda: _libc("munlockall")
        )
    if request.cpu_latency:
        latency = _Latency()
        schedule.attempt("processor latency", latency.open, latency.close)
    if request.cpus:
        before = os.sched_getaffinity(0)
        schedule.attempt(
            f"processors {_listed(request.cpus)}",
            lambda: _keep_to(request.cpus, before),
            lambda: os.sched_setaffinity(0, before),
        )
    if request.priority:
        schedule.attempt(
            f"FIFO {request.priority}",
            # later threads and child processes shall not inherit it
            lambda: os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(request.priority)),
            lambda: os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0)),
        )
    return schedule


def _keep_to(cpus: Collection[int], there: Collection[int]) -> None:
    """Let the process run on some of the processors that are `there`; the kernel alone would ignore missing ones.

    Raises:
        OSError: One of them is missing, or the kernel refuses.
    """
    lacking = sorted(set(cpus) - set(there))
    if lacking:
        raise OSError(errno.EINVAL, f"no processor {_listed(lacking)} for this process, only {_listed(sorted(there))}")
    os.sched_setaffinity(0, cpus)


def _listed(numbers: Iterable[int]) -> str:
    return ", ".join(map(str, numbers))


def _freeze() -> None:
    gc.collect()
    gc.freeze()
    gc.disable()


def _thaw() -> None:
    gc.enable()
    gc.unfreeze()


def _libc(name: str, *arguments: object) -> None:
    """Call a function of the C library.

    Raises:
        OSError: It fails.
    """
    if getattr(ctypes.CDLL(None, use_errno=True), name)(*arguments):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


class _Latency:
    """The file that keeps the processors out of deep sleep as long as it is open."""

    def __init__(self) -> None:
        self._file = -1

    def open(self) -> None:
        self._file = os.open(LATENCY, os.O_WRONLY)
        os.write(self._file, (0).to_bytes(4, "little"))

    def close(self) -> None:
        os.close(self._file)
