"""What `solfer rt record` does."""

import argparse
import sys
import time
from contextlib import closing

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.process import Ending
from solfer.middleware.xbot.recording import Recording

EVERY = 0.1
"""Time between two looks for new records [s]."""


def record(options: argparse.Namespace, namespace: Namespace) -> None:
    """Write a recording of the RT layer to a file.

    Raises:
        MiddlewareError: Nothing is recorded, or the file cannot be written.
    """
    with closing(Recording(namespace.folder, options.file.absolute().parent)) as recording:
        if options.last:
            recording.drain()
        else:
            recording.skip()
            _follow(recording, options.seconds)
        if not recording.count:
            raise MiddlewareError("nothing was recorded: the RT layer has not made a cycle meanwhile",
                                  expected="one that runs; `--last` for what one that has ended left")
        recording.save(options.file)
        _tell(recording, options)


def _follow(recording: Recording, seconds: float | None) -> None:
    """Drain for that time, until somebody asks for the end, or until the layer has ended."""
    end = time.monotonic() + seconds if seconds is not None else float("inf")
    with closing(Ending()) as ending:
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


def _tell(recording: Recording, options: argparse.Namespace) -> None:
    """Say what the file holds."""
    moments = recording.arrays()["time"]
    print(f"{options.file}: {recording.count} cycles in {moments[-1] - moments[0]:.3f} s, {recording.lost} lost")
    if recording.over:
        print(f"the RT layer has ended, its last cycle was {time.monotonic() - moments[-1]:.1f} s ago")
