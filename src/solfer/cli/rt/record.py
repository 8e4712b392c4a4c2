"""Record what plugins measure, desire and send, on every middleware, to a file that all tools of ROS 2 read.

It drains the memory in which a real-time layer, and each node of a plugin, keeps its last seconds, and slows down none
of them. Without NAMESPACE and -n: the only namespace that records. Nodes of a ROS master are in `ros.<user id>.<port>`.
"""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from solfer.cli.options import SECONDS, Number
from solfer.errors import MiddlewareError, RecordingError, UnknownName

if TYPE_CHECKING:
    from solfer.recording.writer import RecordingWriter
    from solfer.segments.namespace import Namespace
    from solfer.telemetry.drain import RecordDrain

POLL_PERIOD = 0.1
"""Period at which new rows are polled [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("namespace", nargs="?", default="", metavar="NAMESPACE", help="namespace of the shared memory")
    parser.add_argument(
        "-n", dest="plugins", action="append", default=[], metavar="PLUGIN", help="plugin to record; may be repeated"
    )
    seconds = Number(0.1, 86400.0, "seconds", zero=True)
    parser.add_argument(
        "--wait", type=seconds, default=0.0, metavar="N", help="wait up to N seconds for -n (default: 0)"
    )
    add_file(parser)


def add_file(parser: argparse.ArgumentParser) -> None:
    """Declare the file, and how long it shall be."""
    parser.add_argument("file", metavar="FILE", type=Path, help="the file, MCAP")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--seconds", type=SECONDS, metavar="N", help="how long (default: until Ctrl-C)")
    length.add_argument("--whole", action="store_true", help="begin with what is in memory already, until Ctrl-C")
    length.add_argument("--last", action="store_true", help="write what is in memory, also after a crash")
    parser.add_argument("--npz", action="store_true", help="write arrays for NumPy's `load` instead of MCAP")


def run(options: argparse.Namespace) -> int:
    """Record running plugins.

    Raises:
        UnknownName: Nothing is recorded by this name.
        MiddlewareError: Nothing was recorded.
        RecordingError: The file cannot be written.
    """
    from solfer.telemetry.black_box import LOOP_PREFIX
    from solfer.telemetry.recordings import of_namespace

    drains = _waited(options) if options.plugins else of_namespace(options.namespace)
    for index, drain in enumerate(drains[1:], start=2):  # each process has a loop
        drain.layout = drain.layout.renamed(LOOP_PREFIX, f"{LOOP_PREFIX}_{index}")
    write(options, drains)
    return 0


def _waited(options: argparse.Namespace) -> "list[RecordDrain]":
    """Return the recordings of the plugins as soon as all of them record.

    Raises:
        UnknownName: One of them does not within the time.
    """
    from solfer.process import ProcessEnd
    from solfer.telemetry.recordings import of_plugins

    end = time.monotonic() + options.wait
    with closing(ProcessEnd()) as ending:
        while True:
            try:
                return of_plugins(options.plugins, options.namespace)
            except UnknownName:
                if time.monotonic() >= end or not ending.running():
                    raise
            time.sleep(POLL_PERIOD)


def record(options: argparse.Namespace, namespace: "Namespace") -> None:
    """Record the RT layer of a namespace; see `run`."""
    from solfer.telemetry.drain import RecordDrain

    write(options, [RecordDrain(namespace.folder)])


def write(options: argparse.Namespace, drains: "Sequence[RecordDrain]") -> None:
    """Write what some processes record to a file.

    Raises:
        MiddlewareError: Nothing was recorded.
        RecordingError: The file cannot be written.
    """
    from solfer.recording.arrays import save_arrays
    from solfer.recording.reader import read
    from solfer.telemetry.drain import writer_of

    path = options.file
    target = path.with_name(f"{path.name}.{os.getpid()}.mcap") if options.npz else path
    try:
        with closing(writer_of(target, drains)) as writer:
            _record(options, drains, writer)
        if options.npz:
            save_arrays(read(target), path)
        _print(options.file, drains, writer)
    except BaseException:
        if not any(drain.count for drain in drains):
            with suppress(OSError):
                target.unlink()
        raise
    finally:
        if options.npz:
            with suppress(OSError):
                target.unlink()


def _record(options: argparse.Namespace, drains: "Sequence[RecordDrain]", writer: "RecordingWriter") -> None:
    """Fill a file, and complete it."""
    if options.last:
        _fill(drains)
    else:
        for drain in () if options.whole else drains:
            drain.skip()
        _follow(drains, options.seconds, writer)
    if not any(drain.count for drain in drains):
        raise MiddlewareError(
            "nothing was recorded: the loop has not made a cycle meanwhile",
            expected="plugins that run, or `--last` for the memory of a layer that has ended",
        )
    writer.finish(sum(drain.lost for drain in drains))


def _fill(drains: "Sequence[RecordDrain]") -> None:
    for drain in drains:
        drain.fill()


def _follow(drains: "Sequence[RecordDrain]", seconds: float | None, writer: "RecordingWriter") -> None:
    """Drain for `seconds`, until a signal requests the end, or until all that record have ended."""
    from solfer.process import ProcessEnd

    begin = time.monotonic()
    end = begin + seconds if seconds is not None else float("inf")
    is_reported = False
    warned = False
    with closing(ProcessEnd()) as ending:
        while True:
            gone = all(drain.over for drain in drains)
            over = gone or not ending.running() or time.monotonic() >= end
            try:
                _fill(drains)
            except RecordingError as error:  # there may be room again later
                if not warned:
                    print(f"warning: {error}", file=sys.stderr, flush=True)
                warned = True
            passed = time.monotonic() - begin
            if not is_reported and passed >= 2.0:  # [s]
                is_reported = True
                print(f"{writer.path}: about {3600e-9 * writer.size / passed:.2g} GB an hour", flush=True)
            if over:
                return
            time.sleep(min(POLL_PERIOD, max(0.0, end - time.monotonic())))


def _print(path: Path, drains: "Sequence[RecordDrain]", writer: "RecordingWriter") -> None:
    """Print what the file contains."""
    for drain in drains:
        first, last = drain.span
        lost = drain.lost + (writer.dropped if drain is drains[0] else 0)
        print(f"{path}: {drain.count - writer.dropped} cycles in {last - first:.3f} s, {lost} lost")
        if drain.over:
            print(f"the recorded process has ended, its last cycle was {time.monotonic() - last:.1f} s ago")
    length = max(drain.span[1] - drain.span[0] for drain in drains)
    if length > 0.0:
        print(f"{1e-6 * writer.size:.2f} MB, {3600e-9 * writer.size / length:.2g} GB an hour")
