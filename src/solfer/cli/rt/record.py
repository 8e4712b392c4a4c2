"""The action `solfer rt record`."""

import argparse
import sys
import time
from contextlib import closing

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.memory.namespace import Namespace
from solfer.realtime.process import ProcessEnd
from solfer.realtime.telemetry.recording import Recording

EVERY = 0.1
"""Period at which new records are polled [s]."""


def record(options: argparse.Namespace, namespace: Namespace) -> None:
    """Write a recording of the RT layer to a file.

    Raises:
        MiddlewareError: Nothing was recorded, or the file cannot be written.
    """
    with closing(Recording(namespace.folder, options.file.absolute().parent)) as recording:
        if options.last:
            recording.drain()
        else:
            recording.skip()
            _follow(recording, options.seconds)
        if not recording.count:
            raise MiddlewareError(
                "nothing was recorded: the RT layer has not made a cycle meanwhile",
                expected="a layer that runs, or `--last` for the memory of one that has ended",
            )
        recording.save(options.file)
        _print(recording, options)


def _follow(recording: Recording, seconds: float | None) -> None:
    """Drain for `seconds`, until a signal asks for the end, or until the layer has ended."""
    end = time.monotonic() + seconds if seconds is not None else float("inf")
    with closing(ProcessEnd()) as ending:
        warned = False
        while True:
            over = recording.over or not ending.running() or time.monotonic() >= end
            try:
                recording.drain()
            except MiddlewareError as error:  # there may be room again later
                if not warned:
                    print(f"warning: {error}", file=sys.stderr, flush=True)
                warned = True
            if over:
                return
            time.sleep(min(EVERY, max(0.0, end - time.monotonic())))


def _print(recording: Recording, options: argparse.Namespace) -> None:
    """Print what the file contains."""
    moments = recording.arrays()["time"]
    print(f"{options.file}: {recording.count} cycles in {moments[-1] - moments[0]:.3f} s, {recording.lost} lost")
    if recording.over:
        print(f"the RT layer has ended, its last cycle was {time.monotonic() - moments[-1]:.1f} s ago")
