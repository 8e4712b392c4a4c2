#!/usr/bin/env python3
"""Measures the cost of pipes in shared memory, and checks that a reader never sees half of a record.

Run with `./run exec python benchmark/shared_memory.py [READS]` (default: 10 million reads of news).

Prints the median time of a call [us]: writing and reading a joint state and a command of 46 joints, and a read that
brings nothing new. Then a process writes records of 150 numbers at full speed, and this one counts the reads that
brought news, the torn ones among them (there must be none: else it ends with 1), and, for comparison, the torn ones
among as many plain copies without the checks of the seqlock.
"""

import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from form import Figures, parser_of

from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.segments.segment import Segment
from solfer.segments.slot import Slot
from solfer.supervision import supervise
from solfer.transport import JointMessage
from solfer.transport.messages import JOINT_FIELDS, JOINT_MESSAGES

READS = 10_000_000
WIDTH = 150
CALLS = 20_000
JOINTS = tuple(f"joint_{index}" for index in range(46))
KIND, SHARED_MEMORY = "benchmark", "/dev/shm"


def cost(*steps: Callable[[], object]) -> list[float]:
    """Measure the median time of each step [us] where all are done in turn."""
    times = np.zeros((len(steps) + 1, CALLS))
    for turn in range(CALLS):
        for index, step in enumerate((*steps, int)):
            start = time.perf_counter_ns()
            step()
            times[index, turn] = time.perf_counter_ns() - start
    medians = 1e-3 * np.median(times, axis=1)
    return list(medians[:-1] - medians[-1])


def print_costs(folder: str, figures: Figures) -> None:
    """Print the cost of writing and reading through the Middleware."""
    namespace = Namespace("benchmark", Path(folder))
    publisher, subscriber = XbotMiddleware(namespace, "publisher"), XbotMiddleware(namespace, "subscriber")
    for kind, fields in (
        ("sensor_msgs/JointState", JOINT_MESSAGES["sensor_msgs/JointState"]),
        ("solfer/JointCommand", JOINT_FIELDS),
    ):
        message = JointMessage.empty(JOINTS, fields)
        writer, reader = publisher.writer(kind, kind), subscriber.reader(kind, kind)
        write, read, again = cost(partial(writer.write, message), reader.read, reader.read)
        figures.row(kind, write_us=write, read_us=read, nothing_new_us=again)


def flood(path: Path, ready: multiprocessing.Event) -> None:
    """Write for ever, each record of one number only."""
    slot = Slot(Segment.create(path, KIND, b"", Slot.size(WIDTH)).data, WIDTH)
    while True:
        slot.values[:] = slot.sequence + 1
        slot.write(0)
        ready.set()


def torn(values: np.ndarray) -> bool:
    """Return whether numbers of more than one write are among them."""
    packed = values.tobytes()
    return packed[8:] != packed[:-8]


def count_torn(path: Path, reads: int) -> tuple[int, int, int]:
    """Count torn reads of the seqlock, reads that it gave up, and torn plain copies."""
    slot = Slot(Segment.attach(path, KIND).data, WIDTH)
    bad = news = plain = 0
    copy = np.zeros(WIDTH)
    while news < reads:
        if slot.read():
            news += 1
            bad += torn(slot.values)
            np.copyto(copy, slot._records[news % 2])
            plain += torn(copy)
        else:
            os.sched_yield()
    return bad, slot.given_up, plain


def main() -> int:
    """Measure, and print."""
    parser = parser_of(__doc__)
    parser.add_argument("reads", type=int, nargs="?", default=READS)
    options = parser.parse_args()
    figures = Figures(options.json)
    with tempfile.TemporaryDirectory(dir=SHARED_MEMORY) as folder:
        print_costs(folder, figures)
        context, path = multiprocessing.get_context("spawn"), Path(folder) / "flood"
        ready = context.Event()
        writer = context.Process(target=flood, args=(path, ready), daemon=True)
        writer.start()
        ready.wait()
        bad, given_up, plain = count_torn(path, options.reads)
        writer.kill()
        writer.join()
    figures.row("reads of news", count=options.reads, torn=bad, given_up=given_up, torn_plain_copies=plain)
    return 1 if bad else 0


if __name__ == "__main__":
    supervise()
    sys.exit(main())
