"""Ends every process that a program starts, directly or not, together with the program, however that ends.

`supervise` puts two processes between the caller and the program:

    front (the caller's process id and terminal) -> keeper (a session of its own) -> program -> what it starts

The front forwards signals. The keeper adopts orphans (PR_SET_CHILD_SUBREAPER), so that all descendants of the program
stay below it, also those with a session of their own. It kills them when the program or the front has ended. A killed
keeper takes the program along (PR_SET_PDEATHSIG), and the front kills what is left.
"""

import ctypes
import os
import select
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

FORWARDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)

REACTION = 0.2
"""Time for the program to receive a signal before what it has started is killed [s]."""

REAP_PERIOD = 0.05
"""Time between two looks at adopted processes that have ended [s]."""

KILL_TIME = 5.0
"""Longest time in which killed processes end [s]."""

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36


def descendants(process: int) -> list[int]:
    """Return the ids of the processes that a process has started, and of those that they have started."""
    found: list[int] = []
    for file in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, file.read_text().split()):
                found += [child, *descendants(child)]
    return found


def supervise(grace: float | None = None) -> None:
    """Return in a child process whose descendants all end with it; the calling process waits and exits like it.

    Call it before threads are started.

    Args:
        grace: Time from a signal until the program is killed [s]; what it has started is killed at once. None: the
            program itself decides when and how it ends.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    requests, writer = os.pipe()
    keeper = os.fork()
    if keeper:
        os.close(requests)
        _front(keeper, writer)
    os.close(writer)
    os.setsid()
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    program = os.fork()
    if program:
        _keep(program, requests, grace)
    os.close(requests)
    end_with_parent()
    # A background job of a script ignores SIGINT; what the program starts must not inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_DFL)


def end_with_parent() -> None:
    """Let this process be killed when the thread that has started it ends, however that ends."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _front(keeper: int, writer: int) -> NoReturn:
    """Forward signals to the keeper until it has ended, and exit like the program."""

    def forward(number: int, _: object) -> None:
        with suppress(OSError):
            os.write(writer, bytes([number]))

    for number in FORWARDED:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, forward)
    _, status = os.waitpid(keeper, 0)
    _kill_descendants()
    _exit_like(status)


def _keep(program: int, requests: int, grace: float | None) -> NoReturn:
    """Wait for the end of the program or of the front, and kill what is left."""
    for number in FORWARDED:
        signal.signal(number, signal.SIG_IGN)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    kept = os.dup2(requests, 3)
    os.closerange(4, os.sysconf("SC_OPEN_MAX"))  # readers of the caller's output see its end
    status = None
    others_end = end = float("inf")
    while status is None and time.monotonic() < end:
        readable, _, _ = select.select([kept], [], [], REAP_PERIOD)
        if readable:
            request = os.read(kept, 1)
            if not request:
                break
            os.kill(program, request[0])
            if grace is not None:
                others_end = min(others_end, time.monotonic() + REACTION)
                end = min(end, time.monotonic() + grace)
        status = _reap(program)
        if time.monotonic() > others_end and status is None:
            _kill_descendants(spared=program)
    if status is None:
        os.kill(program, signal.SIGKILL)
        _, status = os.waitpid(program, 0)
    _kill_descendants()
    _exit_like(status)


def _reap(program: int) -> int | None:
    """Collect processes that have ended; returns the status of the program if it is one of them."""
    status = None
    with suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            if ended[0] == program:
                status = ended[1]
    return status


def _kill_descendants(spared: int = 0) -> None:
    """Kill all descendants of this process but one, also those that are started meanwhile."""
    end = time.monotonic() + KILL_TIME
    while time.monotonic() < end:
        alive = [each for each in descendants(os.getpid()) if each != spared and _is_alive(each)]
        if not alive:
            return
        for process in alive:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        time.sleep(0.005)


def _is_alive(process: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    with suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


def _exit_like(status: int) -> NoReturn:
    """Exit with the code, or by the signal, of a child."""
    code = os.waitstatus_to_exitcode(status)
    if code < 0:
        with suppress(OSError):  # SIGKILL has no handler
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)


def _prctl(option: int, value: int) -> None:
    ctypes.CDLL(None, use_errno=True).prctl(option, value, 0, 0, 0)
